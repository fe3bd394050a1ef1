#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include "base/text/byte_order.h"
#include "tests/import/voxel_support.h"
#include "tools/import/lattice_files/lattice_files.h"

namespace tensorray {
namespace {

/// A header as numpy.save writes it: padded with spaces to a multiple of 64 bytes.
std::string header_of(const std::string& descr, bool fortran, const std::vector<std::size_t>& shape, char version = 1) {
  std::string dictionary = fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': ({},), }}", descr,
                                       fortran ? "True" : "False", fmt::join(shape, ", "));
  const std::size_t start = version == 1 ? 10 : 12;
  while ((start + dictionary.size() + 1) % 64 != 0) dictionary += ' ';
  dictionary += '\n';
  std::string length;
  for (std::size_t i = 0; i < start - 8; ++i) length += static_cast<char>(dictionary.size() >> (8 * i));
  return std::string("\x93NUMPY") + version + '\0' + length + dictionary;
}

/// Entry (row, column) at (x, y, z): exact in half precision.
double entry(int x, int y, int z, int row, int column) { return x + 4 * y + 16 * z + 0.25 * row + 0.0625 * column; }

/// The numbers of a field of shape (nz, ny, nx, 3, 3), each written by `put(value)`.
template <class Number, class Put>
std::string numbers_of(const Vector3i& size, bool fortran, const Put& put) {
  const std::array<int, 5> shape = {size.z(), size.y(), size.x(), 3, 3};
  std::vector<Number> numbers;
  const auto count = static_cast<std::size_t>(size.prod()) * 9;
  for (std::size_t i = 0; i < count; ++i) {
    std::array<int, 5> at{};
    std::size_t rest = i;
    for (std::size_t n = 0; n < 5; ++n) {
      const std::size_t axis = fortran ? n : 4 - n;
      at[axis] = static_cast<int>(rest % static_cast<std::size_t>(shape[axis]));
      rest /= static_cast<std::size_t>(shape[axis]);
    }
    numbers.push_back(put(entry(at[2], at[1], at[0], at[3], at[4])));
  }
  return test::bytes_of(numbers);
}

void expect_field(const std::filesystem::path& path, const Vector3i& size) {
  const TensorGrid grid = test::tensors_of(open_npy(path));
  EXPECT_EQ(grid.active_voxels(), static_cast<std::size_t>(size.prod()));
  EXPECT_TRUE(grid.to_world.matrix().isIdentity());
  int wrong = 0;
  test::for_each_voxel(grid, [&](const Vector3i& i, const Matrix3d& tensor) {
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        if (tensor(row, column) != entry(i.x(), i.y(), i.z(), row, column)) ++wrong;
  });
  EXPECT_EQ(wrong, 0) << path;
}

const Vector3i size(4, 3, 19);
const std::vector<std::size_t> shape = {19, 3, 4, 3, 3};

TEST(Npy, EveryPrecisionByteOrderAndArrangementIsRead) {
  const auto as_float = [](double value) { return static_cast<float>(value); };
  const auto half = [](double value) { return Eigen::half(static_cast<float>(value)).x; };
  ASSERT_EQ(half(1.5), 0x3e00);
  const Vector3i small(4, 2, 2);  // Its numbers have at most the eleven bits of half precision.
  for (const bool fortran : {false, true}) {
    const auto expect = [&](const std::string& bytes, const Vector3i& of_size) {
      expect_field(test::TemporaryFile("field.npy", bytes), of_size);
    };
    expect(header_of("<f4", fortran, shape) + numbers_of<float>(size, fortran, as_float), size);
    expect(header_of(">f4", fortran, shape, 2) +
               numbers_of<float>(size, fortran, [&](double value) { return test::swapped(as_float(value)); }),
           size);
    expect(header_of("<f8", fortran, shape, 3) + numbers_of<double>(size, fortran, [](double v) { return v; }), size);
    expect(header_of(">f8", fortran, shape) + numbers_of<double>(size, fortran, test::swapped<double>), size);
    expect(header_of("<f2", fortran, {2, 2, 4, 3, 3}) + numbers_of<std::uint16_t>(small, fortran, half), small);
    expect(header_of(">f2", fortran, {2, 2, 4, 3, 3}) +
               numbers_of<std::uint16_t>(small, fortran, [&](double value) { return test::swapped(half(value)); }),
           small);
  }
}

TEST(Npy, SixAskForTheirOrderAndThreeAreAVector) {
  const std::vector<double> six = {11, 22, 33, 23, 13, 12};
  const test::TemporaryFile file("six.npy", header_of("<f8", false, {1, 1, 1, 6}) + test::bytes_of(six));
  test::expect_error([&] { test::tensors_of(open_npy(file)); }, {"--order"});
  const TensorGrid grid = test::tensors_of(open_npy(file), TensorOrder::voigt);
  test::expect_near(test::symmetric({11, 12, 13, 22, 23, 33}), test::voxel(grid, {0, 0, 0}));

  const std::vector<double> vectors = {0, 0, 0, 5, 0, 0};  // v = (5 y, 0, 0)
  write_bytes(file, header_of("<f8", false, {1, 2, 1, 3}) + test::bytes_of(vectors));
  LatticeReport report;
  const TensorGrid gradient = gradient_of(open_npy(file), report);
  Matrix3d expected = Matrix3d::Zero();
  expected(0, 1) = 5;
  test::expect_near(expected, test::voxel(gradient, {0, 0, 0}));
}

TEST(Npy, WrongFilesAreErrorsOfOneLine) {
  const std::string numbers(9 * 8 * 4, '\1');
  const auto expect = [](const std::string& bytes, const std::vector<std::string>& words) {
    test::refuses(open_npy, "wrong.npy", bytes, words);
  };
  using Shape = std::vector<std::size_t>;
  const auto floats = [](const Shape& extents) { return header_of("<f4", false, extents); };
  const Shape good{2, 2, 2, 3, 3};
  test::expect_error([] { open_npy("absent.npy"); }, {"absent.npy", "no such file"});
  expect("", {"not a .npy"});
  expect("NRRD0004\ntype: float\n", {"not a .npy"});
  expect(floats(good).substr(0, 40), {"cut off"});
  expect(floats(good) + numbers.substr(1), {"288 bytes", "287", "cut off"});
  expect(floats(good) + numbers + "1", {"several arrays"});
  expect(floats({2, 2, 2, 9, 1}) + numbers, {"shape is (2, 2, 2, 9, 1)", "(nz, ny, nx, 3, 3)"});
  expect(floats({2, 2, 18}) + numbers, {"shape is (2, 2, 18)"});
  expect(floats({2, 2, 2, 7}) + numbers, {"shape is (2, 2, 2, 7)"});
  expect(floats({0, 2, 2, 3, 3}), {"empty"});
  for (const char* type : {"<i4", "|O"}) expect(header_of(type, false, good) + numbers, {"astype"});
  expect(floats({2147483647, 2147483647, 2147483647, 3, 3}) + numbers, {"cut off"});
  expect(floats({99999999999, 2, 2, 3, 3}) + numbers, {"damaged"});
}

const Vector3i lattice_size(3, 4, 2);

/// Component c of a voxel: a number that tells voxel and component.
double value_at(const Vector3i& index, int c) { return 1 + index.x() + 10 * index.y() + 100 * index.z() + 1000 * c; }

/// A file with these numbers. @param layout  Rank and sense of each axis, as the format writes it.
std::string mrtrix_file(const std::string& layout, const std::string& datatype, int volumes = 6,
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
        const std::string contents = mrtrix_file(layout, datatype);
        const test::TemporaryFile file(packed ? "a.mif.gz" : "a.mif", packed ? gzipped(contents) : contents);
        const TensorGrid grid = test::tensors_of(open_mrtrix(file));  // In the order of MRtrix, without being told.
        ASSERT_EQ(grid.active_voxels(), 24u);
        test::for_each_voxel(grid, [&](const Vector3i& i, const Matrix3d& tensor) {
          const auto v = [&](int c) { return value_at(i, c); };
          const Matrix3d expected = test::symmetric({v(0), v(3), v(4), v(1), v(5), v(2)});
          EXPECT_EQ(tensor, expected) << layout << ' ' << datatype << ' ' << i.transpose();
        });
      }
}

TEST(Mrtrix, TransformAndScalingAreApplied) {
  const test::TemporaryFile file(
      "a.mif", mrtrix_file("+0,+1,+2,+3", "Float32LE", 9,
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
  const test::TemporaryFile file("a.mif", mrtrix_file("+0,+1,+2,+3", "Float32LE", 6,
                                                      "transform: -1,0,0,0\ntransform: 0,1,0,0\ntransform: 0,0,1,0\n"));
  const auto v = [](int c) { return value_at({1, 1, 1}, c); };
  const Matrix3d fsl = test::symmetric({v(0), -v(1), -v(2), v(3), v(4), v(5)});
  test::expect_near(fsl, test::voxel(test::tensors_of(open_mrtrix(file), TensorOrder::fsl), {1, 1, 1}));
}

TEST(Mrtrix, HeadersWithAFileOfNumbers) {
  const std::string whole = mrtrix_file("+0,+1,+2,+3", "Float32LE");
  const test::TemporaryFile data("a.dat", whole.substr(whole.size() - 24 * 6 * 4));
  const std::string header = whole.substr(0, whole.find("file:"));
  const test::TemporaryFile file("a.mih", header + "file: " + data.filename().string() + "\n");
  EXPECT_EQ((*test::voxel(test::tensors_of(open_mrtrix(file)), {2, 0, 1}))(1, 2), value_at({2, 0, 1}, 5));
}

TEST(Mrtrix, DamageAndOtherKindsAreErrorsWithTheFile) {
  const std::string sound = mrtrix_file("+0,+1,+2,+3", "Float32LE");
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
  const test::TemporaryFile file("a.mif", mrtrix_file("+0,+1,+2,+3", "Float32LE", 6, "END_of: 12:30\nENDIAN: x\n"));
  const Lattice lattice = open_mrtrix(file);
  EXPECT_EQ(lattice.to_world * Vector3d(0, 0, 0), Vector3d(-2, -3.75, -1.5));
  EXPECT_EQ(lattice.to_world * Vector3d(2, 3, 1), Vector3d(2, 3.75, 1.5));
}

}  // namespace
}  // namespace tensorray
