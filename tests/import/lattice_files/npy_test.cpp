#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/text/byte_order.h"
#include "tests/import/imported.h"
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

using Shape = std::vector<std::size_t>;

/// A field of shape (nz, ny, nx, 3, 3), whose numbers are written by `put(value)`.
template <class Put>
std::string field_of(const std::string& descr, char version, bool fortran, const Shape& shape, const Put& put) {
  std::vector<decltype(put(0.0))> numbers;
  for (std::size_t i = 0; i < shape[0] * shape[1] * shape[2] * 9; ++i) {
    std::array<int, 5> at{};
    std::size_t rest = i;
    for (std::size_t n = 0; n < 5; ++n) {
      const std::size_t axis = fortran ? n : 4 - n;
      at[axis] = static_cast<int>(rest % shape[axis]);
      rest /= shape[axis];
    }
    numbers.push_back(put(entry(at[2], at[1], at[0], at[3], at[4])));
  }
  return header_of(descr, fortran, shape, version) + test::bytes_of(numbers);
}

void expect_field(const std::filesystem::path& path, const Shape& shape) {
  const TensorGrid grid = test::tensors_of(open_npy(path));
  EXPECT_EQ(grid.active_voxels(), shape[0] * shape[1] * shape[2]);
  EXPECT_TRUE(grid.to_world.matrix().isIdentity());
  int wrong = 0;
  for_each_active(grid, [&](const Vector3i& i, const Matrix3f& tensor) {
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        if (tensor(row, column) != entry(i.x(), i.y(), i.z(), row, column)) ++wrong;
  });
  EXPECT_EQ(wrong, 0) << path;
}

TEST(Npy, EveryPrecisionByteOrderAndArrangementIsRead) {
  const auto as_float = [](double value) { return static_cast<float>(value); };
  const auto half = [](double value) { return Eigen::half(static_cast<float>(value)).x; };
  ASSERT_EQ(half(1.5), 0x3e00);
  const Shape shape{19, 3, 4, 3, 3}, small{2, 2, 4, 3, 3};  // The numbers of the small one fit half precision.
  for (const bool fortran : {false, true}) {
    const auto expect = [&](const char* descr, char version, const Shape& of, const auto& put) {
      SCOPED_TRACE(fmt::format("{}, Fortran: {}", descr, fortran));
      expect_field(Temporary("field.npy", field_of(descr, version, fortran, of, put)), of);
    };
    expect("<f4", 1, shape, as_float);
    expect(">f4", 2, shape, [&](double value) { return test::swapped(as_float(value)); });
    expect("<f8", 3, shape, [](double value) { return value; });
    expect(">f8", 1, shape, test::swapped<double>);
    expect("<f2", 1, small, half);
    expect(">f2", 1, small, [&](double value) { return test::swapped(half(value)); });
  }
}

TEST(Npy, VoxelsAreWhereTheUserSays) {
  const Temporary file("placed.npy",
                       header_of("<f4", false, {2, 3, 4, 3, 3}) + test::bytes_of(std::vector<float>(2 * 3 * 4 * 9, 1)));
  ImportSettings settings;
  const auto read = [&] { return imported(file, settings).grid; };
  EXPECT_TRUE(read().to_world.matrix().isIdentity());
  settings.sampling.resolution = 0.25;
  settings.origin = Vector3d(-1, 2, 5);
  const TensorGrid grid = read();
  EXPECT_EQ(Vector3d(grid.to_world * Vector3d::Zero()), Vector3d(-1, 2, 5));
  EXPECT_EQ(Vector3d(grid.to_world * Vector3d(3, 2, 1)), Vector3d(-0.25, 2.5, 5.25));
  EXPECT_EQ(grid.active_voxels(), 24u);
  settings.voxel = Vector3d(0.5, 0.25, 2);
  EXPECT_EQ(Vector3d(read().to_world * Vector3d(3, 2, 1)), Vector3d(0.5, 2.5, 7));
  settings.voxel.reset();
  settings.sampling.bounds = AlignedBox3d(Vector3d(-1, 2, 5), Vector3d(-0.75, 2.5, 5));
  EXPECT_EQ(read().active_voxels(), 6u);  // The bounds are in world space.
}

TEST(Npy, SixAskForTheirOrderAndThreeAreAVector) {
  const std::vector<double> six = {11, 22, 33, 23, 13, 12}, vectors = {0, 0, 0, 5, 0, 0};  // v = (5 y, 0, 0)
  const Temporary file("six.npy", header_of("<f8", false, {1, 1, 1, 6}) + test::bytes_of(six));
  test::expect_error([&] { test::tensors_of(open_npy(file)); }, {"--order"});
  const TensorGrid grid = test::tensors_of(open_npy(file), TensorOrder::voigt);
  test::expect_near(test::symmetric({11, 12, 13, 22, 23, 33}), find(grid, {0, 0, 0}));
  write_bytes(file, header_of("<f8", false, {1, 2, 1, 3}) + test::bytes_of(vectors));
  LatticeReport report;
  const TensorGrid gradient = gradient_of(open_npy(file), report);
  test::expect_near(5 * Vector3d::UnitX() * Vector3d::UnitY().transpose(), find(gradient, {0, 0, 0}));
}

TEST(Npy, WrongFilesAreErrorsOfOneLine) {
  const std::string numbers(9 * 8 * 4, '\1');
  const auto expect = [](const std::string& bytes, const std::vector<std::string>& words) {
    test::refuses(open_npy, "wrong.npy", bytes, words);
  };
  const auto floats = [](const Shape& extents) { return header_of("<f4", false, extents); };
  const Shape good{2, 2, 2, 3, 3};
  test::expect_error([] { open_npy("absent.npy"); }, {"absent.npy", "no such file"});
  for (const char* other : {"", "NRRD0004\ntype: float\n"}) expect(other, {"not a .npy"});
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
  for (int i = 0; i < lattice_size.prod() * volumes; ++i) {
    std::array<int, 4> index{};
    for (int rank = 0, rest = i; rank < 4; ++rank) {
      const int axis = axis_of_rank[rank], at = rest % extents[axis];
      index[axis] = reversed[axis] ? extents[axis] - 1 - at : at;
      rest /= extents[axis];
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

TEST(Mrtrix, EveryLayoutAndTypeGivesTheSameTensors) {
  for (const std::string layout : {"+0,+1,+2,+3", "-0,+1,-2,+3", "-1,+2,-3,+0", "+3,-2,+1,-0"})
    for (const std::string datatype : {"Float32LE", "Float64BE", "UInt16BE", "Int32"})
      for (const bool packed : {false, true}) {
        const std::string contents = mrtrix_file(layout, datatype);
        const Temporary file(packed ? "a.mif.gz" : "a.mif", packed ? test::gzipped(contents) : contents);
        const TensorGrid grid = test::tensors_of(open_mrtrix(file));  // In the order of MRtrix, without being told.
        ASSERT_EQ(grid.active_voxels(), 24u);
        for_each_active(grid, [&](const Vector3i& i, const Matrix3f& tensor) {
          const auto v = [&](int c) { return value_at(i, c); };
          const Matrix3d expected = test::symmetric({v(0), v(3), v(4), v(1), v(5), v(2)});
          EXPECT_EQ(tensor, expected.cast<float>()) << layout << ' ' << datatype << ' ' << i.transpose();
        });
      }
}

TEST(Mrtrix, TransformAndScalingAreApplied) {
  const Temporary file("a.mif",
                       mrtrix_file("+0,+1,+2,+3", "Float32LE", 9,
                                   "transform: 0,-1,0,10\ntransform: 1,0,0,20\ntransform: 0,0,1,30\nscaling: 5,0.5\n"));
  const Lattice lattice = open_mrtrix(file);
  const Matrix3d linear = (Matrix3d() << 0, -2.5, 0, 2, 0, 0, 0, 0, 3).finished();
  EXPECT_LT((lattice.to_world.linear() - linear).norm(), 1e-12);
  EXPECT_EQ(lattice.to_world.translation(), Vector3d(10, 20, 30));
  const TensorGrid grid = test::tensors_of(lattice);
  EXPECT_EQ((*find(grid, {2, 3, 1}))(0, 1), 5 + 0.5 * value_at({2, 3, 1}, 1));
}

TEST(Mrtrix, TheUserGivesAnotherOrderWithItsAxes) {
  const Temporary file("a.mif", mrtrix_file("+0,+1,+2,+3", "Float32LE", 6,
                                            "transform: -1,0,0,0\ntransform: 0,1,0,0\ntransform: 0,0,1,0\n"));
  const auto v = [](int c) { return value_at({1, 1, 1}, c); };
  const Matrix3d fsl = test::symmetric({v(0), -v(1), -v(2), v(3), v(4), v(5)});
  test::expect_near(fsl, find(test::tensors_of(open_mrtrix(file), TensorOrder::fsl), {1, 1, 1}));
}

TEST(Mrtrix, HeadersWithAFileOfNumbers) {
  const std::string whole = mrtrix_file("+0,+1,+2,+3", "Float32LE");
  const Temporary data("a.dat", whole.substr(whole.size() - 24 * 6 * 4));
  const std::string header = whole.substr(0, whole.find("file:"));
  const Temporary file("a.mih", header + "file: " + data.filename().string() + "\n");
  EXPECT_EQ((*find(test::tensors_of(open_mrtrix(file)), {2, 0, 1}))(1, 2), value_at({2, 0, 1}, 5));
}

TEST(Mrtrix, DamageAndOtherKindsAreErrorsWithTheFile) {
  const std::string sound = mrtrix_file("+0,+1,+2,+3", "Float32LE");
  const auto expect = [](const std::string& contents, const std::string& word) {
    test::refuses(open_mrtrix, "bad.mif", contents, {word});
  };
  const auto changed = [&](const char* from, const char* to) { return replaced_text(sound, from, to); };
  expect("", "MRtrix");
  for (const std::size_t end : {std::size_t{40}, sound.size() - 1}) expect(sound.substr(0, end), "cut off");
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
  const Temporary file("a.mif", mrtrix_file("+0,+1,+2,+3", "Float32LE", 6, "END_of: 12:30\nENDIAN: x\n"));
  const Lattice lattice = open_mrtrix(file);
  EXPECT_EQ(lattice.to_world * Vector3d(0, 0, 0), Vector3d(-2, -3.75, -1.5));
  EXPECT_EQ(lattice.to_world * Vector3d(2, 3, 1), Vector3d(2, 3.75, 1.5));
}

}  // namespace
}  // namespace tensorray
