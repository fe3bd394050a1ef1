#include <algorithm>

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

/// A header of single-precision numbers; `fields` are further lines.
std::string header_of(int channels, const Vector3i& size, const std::string& fields = "",
                      const std::string& type = "MET_FLOAT", const std::string& file = "LOCAL") {
  return fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\n{}DimSize = {} {} {}\nElementNumberOfChannels = {}\n"
      "ElementType = {}\nElementDataFile = {}\n",
      fields, size.x(), size.y(), size.z(), channels, type, file);
}

std::vector<float> upper_triangle(const Matrix3d& t, double factor = 1) {
  std::vector<float> numbers;
  for (const double c : {t(0, 0), t(0, 1), t(0, 2), t(1, 1), t(1, 2), t(2, 2)})
    numbers.push_back(static_cast<float>(factor * c));
  return numbers;
}

/// 2 × 1 × 1 voxels: a tensor, and its half.
std::vector<float> two_voxels() {
  std::vector<float> numbers = upper_triangle(test::symmetric_tensor());
  for (const float number : upper_triangle(test::symmetric_tensor(), 0.5)) numbers.push_back(number);
  return numbers;
}

std::string deflated(const std::string& bytes) {
  std::string result(compressBound(bytes.size()), '\0');
  uLongf size = result.size();
  compress(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  return result.substr(0, size);
}

const Matrix3d flip = Vector3d(-1, -1, 1).asDiagonal();  // From LPS to RAS.

void expect_two_voxels(const Lattice& lattice) {
  const TensorGrid grid = test::tensors_of(lattice);
  const Matrix3d expected = flip * test::symmetric_tensor() * flip;
  test::expect_near(expected, test::voxel(grid, {0, 0, 0}));
  test::expect_near(0.5 * expected, test::voxel(grid, {1, 0, 0}));
}

TEST(MetaImage, ComponentsAndWorldAreOfLps) {
  const Matrix3d turn = test::rotation();  // Its columns are the directions of the axes, one after the other.
  std::string matrix;
  for (int i = 0; i < 9; ++i) matrix += fmt::format(" {}", turn(i % 3, i / 3));
  const test::TemporaryFile file(
      "a.mha", header_of(6, {2, 1, 1}, "TransformMatrix =" + matrix + "\nOffset = 10 20 30\nElementSpacing = 2 3 4\n") +
                   test::bytes_of(two_voxels()));
  const Lattice lattice = open_metaimage(file);
  expect_two_voxels(lattice);
  EXPECT_LT((lattice.to_world * Vector3d::Zero() - Vector3d(-10, -20, 30)).norm(), 1e-9);
  EXPECT_LT((lattice.to_world.linear() - flip * turn * Vector3d(2, 3, 4).asDiagonal()).norm(), 1e-5);
}

TEST(MetaImage, EveryPlaceOfTheNumbers) {
  const std::string bytes = test::bytes_of(two_voxels());
  std::string swapped = bytes, doubles;
  for (auto number = swapped.begin(); number != swapped.end(); number += 4) std::reverse(number, number + 4);
  for (const float number : two_voxels()) append_number(static_cast<double>(number), ByteOrder::little, doubles);
  const auto expect_sound = [&](const std::string& contents, const std::string& data = "") {
    const test::TemporaryFile raw("a.raw", data), file("a.mhd", contents);
    expect_two_voxels(open_metaimage(file));
  };
  const std::string raw_name = test::TemporaryFile("a.raw").filename();
  expect_sound(header_of(6, {2, 1, 1}) + bytes);
  expect_sound(header_of(6, {2, 1, 1}, "BinaryDataByteOrderMSB = True\n") + swapped);
  expect_sound(header_of(6, {2, 1, 1}, "CompressedData = True\nCompressedDataSize = 7\n") + deflated(bytes));
  expect_sound(header_of(6, {2, 1, 1}, "", "MET_DOUBLE") + doubles);
  expect_sound(header_of(6, {2, 1, 1}, "", "MET_FLOAT", raw_name), bytes);
  expect_sound(header_of(6, {2, 1, 1}, "HeaderSize = 5\n", "MET_FLOAT", raw_name), "12345" + bytes);
  expect_sound(header_of(6, {2, 1, 1}, "HeaderSize = -1\n", "MET_FLOAT", raw_name), "1234567" + bytes);
  expect_sound(header_of(6, {2, 1, 1}, "CompressedData = True\n", "MET_FLOAT", raw_name), deflated(bytes));
}

TEST(MetaImage, DamageAndOtherKindsAreErrorsWithTheFile) {
  const std::string bytes = test::bytes_of(two_voxels());
  const auto expect = [](const std::string& contents, const std::string& word) {
    test::refuses(open_metaimage, "bad.mha", contents, {word});
  };
  expect("", "MetaImage");
  expect("NDims = 3\n", "ElementDataFile");
  expect(header_of(6, {2, 1, 1}) + bytes.substr(1), "cut off");
  expect(header_of(6, {2, 1, 1}, "CompressedData = True\n") + deflated(bytes).substr(0, 9), "cut off");
  expect(header_of(6, {2, 1, 1}, "CompressedData = True\n") + bytes, "damaged");
  expect(header_of(6, {20000, 20000, 20000}) + bytes, "announces");
  expect(header_of(6, {0, 1, 1}) + bytes, "DimSize");
  expect(header_of(5, {2, 1, 1}) + bytes, "5 channels");
  expect(header_of(6, {2, 1, 1}, "NDims = 2\n") + bytes, "NDims");
  expect(
      "NDims = 3\nDimSize = 2 1 1\nElementNumberOfChannels = 6\nElementType = MET_FLOAT\nBinaryData = False\n"
      "ElementDataFile = LOCAL\n" +
          bytes,
      "text");
  expect(header_of(6, {2, 1, 1}, "TransformMatrix = 1 0 0 1 0 0 0 0 1\n") + bytes, "inverted");
  expect(header_of(6, {2, 1, 1}, "ElementSpacing = 1 x 1\n") + bytes, "ElementSpacing");
  expect(header_of(6, {2, 1, 1}, "", "MET_OTHER") + bytes, "MET_OTHER");
  expect(header_of(6, {2, 1, 1}, "", "MET_FLOAT", "none.raw"), "none.raw");
  expect(header_of(6, {2, 1, 1}, "", "MET_FLOAT", "LIST") + bytes, "several files");
  std::string header = header_of(6, {1, 1, 1}, "", "MET_UCHAR");
  header.pop_back();  // The last line does not end.
  expect(header, "announces 6 bytes");
}

}  // namespace
}  // namespace tensorray
