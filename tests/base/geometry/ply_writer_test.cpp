#include "base/geometry/box.h"
#include "base/geometry/triangle_mesh.h"
#include "base/text/byte_order.h"
#include "tests/files.h"

namespace tensorray {
namespace {

TEST(PlyWriter, KeepsDoublePrecisionAndIsLittleEndian) {
  TriangleMesh mesh;
  mesh.vertices = {{0.1, -1e300, 3}, {1.0 / 3, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {2, 1, 0}};
  const Temporary path("a.ply");
  write_ply(path, mesh, PlyPositions::double_precision);
  std::string expected =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
      "property double z\nelement face 2\nproperty list uchar uint vertex_indices\nend_header\n";
  for (const Vector3d& vertex : mesh.vertices)
    for (const double x : vertex) append_number(x, ByteOrder::little, expected);
  for (const auto& triangle : mesh.triangles) {
    expected += '\3';
    for (const std::uint32_t corner : triangle) append_number(corner, ByteOrder::little, expected);
  }
  EXPECT_EQ(bytes_of(path), expected);
}

TEST(PlyWriter, NamesAFileThatCannotBeWritten) {
  EXPECT_THAT(message([] { write_ply("/no/such/folder/a.ply", {}, PlyPositions::single_precision); }),
              HasSubstr("/no/such/folder/a.ply: cannot be written"));
}

TEST(TurnBetween, IsTheSmallestRotationOfOneDirectionToTheOther) {
  const Vector3d directions[] = {{1, 0, 0},  {-1, 0, 0},  {0, 0, 2},   {0, 1e-9, -1},
                                 {3, -4, 5}, {-3, 4, -5}, {1, 1e-7, 0}};
  for (const Vector3d& from : directions)
    for (const Vector3d& to : directions) {
      const Eigen::Quaterniond turn = turn_between(from, to);
      EXPECT_NEAR(turn.norm(), 1, 1e-9);
      EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-6) << from << "\n" << to;
      const double angle = std::atan2(from.cross(to).norm(), from.dot(to));
      EXPECT_NEAR(2 * std::atan2(turn.vec().norm(), turn.w()), angle, 1e-6) << from << "\n" << to;
    }
}

}  // namespace
}  // namespace tensorray
