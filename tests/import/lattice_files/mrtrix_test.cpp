#include <array>

#include <fmt/format.h>
#include <zlib.h>

#include "base/text/byte_order.h"
#include "tests/import/voxel_support.h"
#include "tools/import/lattice_files/lattice_files.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

const Vector3i lattice_size(3, 4, 2);

/// Component c of a voxel: a number that tells voxel and component.
double value_at(const Vector3i& index, int c) { return 1 + index.x() + 10 * index.y() + 100 * index.z() + 1000 * c; }

/// A file with these numbers. @param layout  Rank and sense of each axis, as the format writes it.
std::string file_of(const std::string& layout, const std::string& datatype, int volumes = 6,
                    const std::string& fields = "") {
  const std::array<int, 4> extents{lattice_size.x(), lattice_size.y(), lattice_size.z(), volumes};
  std::array<int, 4> axis_of_rank{}, reversed{};
  for (std::size_t i = 0, at = 0; i < 4; ++i, at = layout.find(',', at) + 1) {
    reversed[i] = layout[at] == '-';
    axis_of_rank[static_cast<std::size_t>(layout[at + 1] - '0')] = static_cast<int>(i);
  }
  std::string numbers;
  std::array<int, 4> at{};  // By rank.
  const auto extent = [&](int rank) { return extents[axis_of_rank[rank]]; };
  for (at[3] = 0; at[3] < extent(3); ++at[3])
    for (at[2] = 0; at[2] < extent(2); ++at[2])
      for (at[1] = 0; at[1] < extent(1); ++at[1])
        for (at[0] = 0; at[0] < extent(0); ++at[0]) {
          std::array<int, 4> index{};
          for (int rank = 0; rank < 4; ++rank) {
            const int axis = axis_of_rank[rank];
            index[axis] = reversed[axis] ? extents[axis] - 1 - at[rank] : at[rank];
          }
          const double value = value_at({index[0], index[1], index[2]}, index[3]);
          if (datatype == "Float32LE") append_number(static_cast<float>(value), ByteOrder::little, numbers);
          if (datatype == "Float64BE") append_number(value, ByteOrder::big, numbers);
          if (datatype == "UInt16BE") append_number(static_cast<std::uint16_t>(value), ByteOrder::big, numbers);
          if (datatype == "Int32") append_number(static_cast<std::int32_t>(value), host_byte_order(), numbers);
        }
  const std::string header = fmt::format("mrtrix image\ndim: 3,4,2,{}\nvox: 2,2.5,3,nan\nlayout: {}\ndatatype: {}\n{}",
                                         volumes, layout, datatype, fields);
  const std::size_t offset = (header.size() + 32) / 4 * 4;
  std::string file = header + fmt::format("file: . {}\nEND\n", offset);
  file.resize(offset);
  return file + numbers;
}

std::string gzipped(const std::string& bytes) {
  const test::TemporaryFile file("packed.gz");
  const gzFile out = gzopen(file.c_str(), "wb");
  gzwrite(out, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(out);
  return bytes_of(file);
}

TEST(Mrtrix, EveryLayoutAndTypeGivesTheSameTensors) {
  for (const std::string layout : {"+0,+1,+2,+3", "-0,+1,-2,+3", "-1,+2,-3,+0", "+3,-2,+1,-0"})
    for (const std::string datatype : {"Float32LE", "Float64BE", "UInt16BE", "Int32"})
      for (const bool packed : {false, true}) {
        const std::string contents = file_of(layout, datatype);
        const test::TemporaryFile file(packed ? "a.mif.gz" : "a.mif", packed ? gzipped(contents) : contents);
        const TensorGrid grid = test::tensors_of(open_mrtrix(file));  // In the order of MRtrix, without being told.
        ASSERT_EQ(grid.active_voxels(), 24u);
        test::for_each_voxel(grid, [&](const Vector3i& i, const Matrix3d& tensor) {
          const auto v = [&](int c) { return value_at(i, c); };
          const Matrix3d expected = (Matrix3d() << v(0), v(3), v(4), v(3), v(1), v(5), v(4), v(5), v(2)).finished();
          EXPECT_EQ(tensor, expected) << layout << ' ' << datatype << ' ' << i.transpose();
        });
      }
}

TEST(Mrtrix, TransformAndScalingAreApplied) {
  const test::TemporaryFile file(
      "a.mif", file_of("+0,+1,+2,+3", "Float32LE", 9,
                       "transform: 0,-1,0,10\ntransform: 1,0,0,20\ntransform: 0,0,1,30\nscaling: 5,0.5\n"));
  const Lattice lattice = open_mrtrix(file);
  Matrix3d linear;
  linear << 0, -2.5, 0, 2, 0, 0, 0, 0, 3;
  EXPECT_LT((lattice.to_world.linear() - linear).norm(), 1e-12);
  EXPECT_EQ(lattice.to_world.translation(), Vector3d(10, 20, 30));
  const TensorGrid grid = test::tensors_of(lattice);
  EXPECT_EQ((*test::voxel(grid, {2, 3, 1}))(0, 1), 5 + 0.5 * value_at({2, 3, 1}, 1));
}

TEST(Mrtrix, TheUserGivesAnotherOrderWithItsAxes) {
  const test::TemporaryFile file(
      "a.mif", file_of("+0,+1,+2,+3", "Float32LE", 6, "transform: -1,0,0,0\ntransform: 0,1,0,0\ntransform: 0,0,1,0\n"));
  const auto v = [](int c) { return value_at({1, 1, 1}, c); };
  const Matrix3d fsl = (Matrix3d() << v(0), -v(1), -v(2), -v(1), v(3), v(4), -v(2), v(4), v(5)).finished();
  test::expect_near(fsl, test::voxel(test::tensors_of(open_mrtrix(file), TensorOrder::fsl), {1, 1, 1}));
}

TEST(Mrtrix, HeadersWithAFileOfNumbers) {
  const std::string whole = file_of("+0,+1,+2,+3", "Float32LE");
  const test::TemporaryFile data("a.dat", whole.substr(whole.size() - 24 * 6 * 4));
  const std::string header = whole.substr(0, whole.find("file:"));
  const test::TemporaryFile file("a.mih", header + "file: " + data.filename().string() + "\n");
  EXPECT_EQ((*test::voxel(test::tensors_of(open_mrtrix(file)), {2, 0, 1}))(1, 2), value_at({2, 0, 1}, 5));
}

TEST(Mrtrix, DamageAndOtherKindsAreErrorsWithTheFile) {
  const std::string sound = file_of("+0,+1,+2,+3", "Float32LE");
  const auto expect = [](const std::string& contents, const std::string& word) {
    test::refuses(open_mrtrix, "bad.mif", contents, {word});
  };
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string contents = sound;
    return contents.replace(contents.find(from), from.size(), to);
  };
  expect("", "MRtrix");
  expect(sound.substr(0, 40), "cut off");
  expect(sound.substr(0, sound.size() - 1), "cut off");
  expect(changed("dim: 3,4,2,6", "dim: 3,4,2,5"), "six or nine");
  expect(changed("dim: 3,4,2,6", "dim: 3,4,200000,6"), "announces");
  expect(changed("dim: 3,4,2,6", "dim: 3,4,x,6"), "dim");
  expect(changed("+0,+1,+2,+3", "+0,+1,+1,+3"), "layout");
  expect(changed("+0,+1,+2,+3", "+0,+1,+2"), "layout");
  expect(changed("Float32LE", "CFloat32LE"), "CFloat32LE");
  expect(changed("vox: 2,2.5,3", "vox: 0,2.5,3"), "inverted");
  expect(changed("file: .", "file: none.dat"), "none.dat");
  expect(changed("file: .", "file: a.dat 0\nfile: b.dat"), "mrconvert");
}

TEST(Mrtrix, WithoutATransformTheMiddleIsTheOrigin) {
  // Names that begin as the last line are names.
  const test::TemporaryFile file("a.mif", file_of("+0,+1,+2,+3", "Float32LE", 6, "END_of: 12:30\nENDIAN: x\n"));
  const Lattice lattice = open_mrtrix(file);
  EXPECT_EQ(lattice.to_world * Vector3d(0, 0, 0), Vector3d(-2, -3.75, -1.5));
  EXPECT_EQ(lattice.to_world * Vector3d(2, 3, 1), Vector3d(2, 3.75, 1.5));
}

}  // namespace
}  // namespace tensorray
