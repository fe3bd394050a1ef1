#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tests/import/voxel_support.h"
#include "tools/import/lattice_files/lattice_files.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3i;

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

template <class Number>
Number swapped(Number number) {
  auto* bytes = reinterpret_cast<char*>(&number);
  std::reverse(bytes, bytes + sizeof number);
  return number;
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
               numbers_of<float>(size, fortran, [&](double value) { return swapped(as_float(value)); }),
           size);
    expect(header_of("<f8", fortran, shape, 3) + numbers_of<double>(size, fortran, [](double v) { return v; }), size);
    expect(header_of(">f8", fortran, shape) + numbers_of<double>(size, fortran, swapped<double>), size);
    expect(header_of("<f2", fortran, {2, 2, 4, 3, 3}) + numbers_of<std::uint16_t>(small, fortran, half), small);
    expect(header_of(">f2", fortran, {2, 2, 4, 3, 3}) +
               numbers_of<std::uint16_t>(small, fortran, [&](double value) { return swapped(half(value)); }),
           small);
  }
}

TEST(Npy, SixAskForTheirOrderAndThreeAreAVector) {
  const std::vector<double> six = {11, 22, 33, 23, 13, 12};
  const test::TemporaryFile file("six.npy", header_of("<f8", false, {1, 1, 1, 6}) + test::bytes_of(six));
  test::expect_error([&] { test::tensors_of(open_npy(file)); }, {"--order"});
  const TensorGrid grid = test::tensors_of(open_npy(file), TensorOrder::voigt);
  test::expect_near((Matrix3d() << 11, 12, 13, 12, 22, 23, 13, 23, 33).finished(), test::voxel(grid, {0, 0, 0}));

  const std::vector<double> vectors = {0, 0, 0, 5, 0, 0};  // v = (5 y, 0, 0)
  file.write(header_of("<f8", false, {1, 2, 1, 3}) + test::bytes_of(vectors));
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
  const auto header = [](const std::string& descr, const std::vector<std::size_t>& extents) {
    return header_of(descr, false, extents);
  };
  test::expect_error([] { open_npy("absent.npy"); }, {"absent.npy", "no such file"});
  expect("", {"not a .npy"});
  expect("NRRD0004\ntype: float\n", {"not a .npy"});
  expect(header("<f4", {2, 2, 2, 3, 3}).substr(0, 40), {"cut off"});
  expect(header("<f4", {2, 2, 2, 3, 3}) + numbers.substr(1), {"288 bytes", "287", "cut off"});
  expect(header("<f4", {2, 2, 2, 3, 3}) + numbers + "1", {"several arrays"});
  expect(header("<f4", {2, 2, 2, 9, 1}) + numbers, {"shape is (2, 2, 2, 9, 1)", "(nz, ny, nx, 3, 3)"});
  expect(header("<f4", {2, 2, 18}) + numbers, {"shape is (2, 2, 18)"});
  expect(header("<f4", {2, 2, 2, 7}) + numbers, {"shape is (2, 2, 2, 7)"});
  expect(header("<f4", {0, 2, 2, 3, 3}), {"empty"});
  expect(header("<i4", {2, 2, 2, 3, 3}) + numbers, {"astype"});
  expect(header("|O", {2, 2, 2, 3, 3}) + numbers, {"astype"});
  expect(header("<f4", {2147483647, 2147483647, 2147483647, 3, 3}) + numbers, {"cut off"});
  expect(header("<f4", {99999999999, 2, 2, 3, 3}) + numbers, {"damaged"});
}

}  // namespace
}  // namespace tensorray
