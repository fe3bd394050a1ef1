#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/geometry/triangle_mesh.h"
#include "base/text/byte_order.h"

namespace tensorray {
namespace {

using ::testing::HasSubstr;

TEST(PlyWriter, KeepsDoublePrecisionAndIsLittleEndian) {
  TriangleMesh mesh;
  mesh.vertices = {{0.1, -1e300, 3}, {1.0 / 3, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {2, 1, 0}};
  const auto path = std::filesystem::path(::testing::TempDir()) / "ply_writer_test.ply";
  write_ply(path, mesh, PlyPositions::double_precision);
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  std::filesystem::remove(path);

  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
      "property double z\nelement face 2\nproperty list uchar uint vertex_indices\nend_header\n";
  ASSERT_EQ(bytes.substr(0, header.size()), header);
  ASSERT_EQ(bytes.size(), header.size() + 3 * 24 + 2 * 13);
  const char* next = bytes.data() + header.size();
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    for (const double x : vertex) {
      EXPECT_EQ(read_number<double>(next, ByteOrder::little), x);
      next += sizeof(double);
    }
  for (const auto& triangle : mesh.triangles) {
    EXPECT_EQ(*next++, 3);
    for (const std::uint32_t corner : triangle) {
      EXPECT_EQ(read_number<std::uint32_t>(next, ByteOrder::little), corner);
      next += sizeof(std::uint32_t);
    }
  }
}

TEST(PlyWriter, NamesAFileThatCannotBeWritten) {
  try {
    write_ply("/no/such/folder/a.ply", {}, PlyPositions::single_precision);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("/no/such/folder/a.ply: cannot be written"));
  }
}

}  // namespace
}  // namespace tensorray
