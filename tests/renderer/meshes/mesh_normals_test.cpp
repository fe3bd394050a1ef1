// Normals of meshes, from files or by angle.

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "base/constants.h"
#include "renderer/meshes/mesh.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// A sphere of radius 2 about the origin, open at its ends.
std::string sphere_ply(bool normals) {
  constexpr int rows = 24, columns = 48;
  std::string header = ply_header("ascii", rows * columns, (rows - 1) * columns), content, faces;
  if (normals) header.insert(header.find("element face"), "property float nx\nproperty float ny\nproperty float nz\n");
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const double theta = pi * (i + 0.5) / rows, phi = 2 * pi * j / columns;
      for (int repeat = 0; repeat < (normals ? 2 : 1); ++repeat)
        for (const double x : {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)})
          content += std::to_string((repeat == 0 ? 2 : 1) * x) + " ";
      content += "\n";
      const int next = (j + 1) % columns;
      if (i + 1 < rows)
        faces += "4 " + std::to_string(i * columns + j) + " " + std::to_string((i + 1) * columns + j) + " " +
                 std::to_string((i + 1) * columns + next) + " " + std::to_string(i * columns + next) + "\n";
    }
  return header + content + faces;
}

TEST(MeshNormalsTest, AreThoseOfTheFileOrMadeByAngle) {
  for (const bool in_file : {true, false}) {
    const Temporary file("sphere.ply", sphere_ply(in_file));
    const std::optional<double> angle = in_file ? std::nullopt : std::optional(0.5);
    const MeshWithNormals sphere = read_mesh_with_normals(file.path(), angle);
    ASSERT_EQ(sphere.normals.size(), 24u * 48u);
    for (std::size_t i = 0; i < sphere.normals.size(); ++i) {
      const Vector3d P = sphere.mesh.vertices[i];
      if (std::abs(P.z()) > 1.98) continue;  // The rims of the open ends.
      EXPECT_LT((sphere.normals[i].cast<double>() - P / 2).norm(), in_file ? 1e-5 : 0.01) << P.transpose();
    }
  }
  const Temporary flat("flat.ply", sphere_ply(false));
  EXPECT_TRUE(read_mesh_with_normals(flat.path(), std::nullopt).normals.empty());
}

TEST(MeshNormalsTest, OfACubeDependOnTheAngle) {
  const Temporary file("cube.obj",
                       "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
                       "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n");
  const MeshWithNormals sharp = read_mesh_with_normals(file.path(), 89 * pi / 180);
  EXPECT_EQ(sharp.mesh.vertices.size(), 24u);
  for (const auto& triangle : sharp.mesh.triangles) {
    const Vector3d& a = sharp.mesh.vertices[triangle[0]];
    const Vector3d flat =
        (sharp.mesh.vertices[triangle[1]] - a).cross(sharp.mesh.vertices[triangle[2]] - a).normalized();
    for (const std::uint32_t corner : triangle) EXPECT_LT((sharp.normals[corner].cast<double>() - flat).norm(), 1e-6);
  }
  // Weights by angle: three faces meet alike at each corner, however they are divided.
  const MeshWithNormals round = read_mesh_with_normals(file.path(), pi / 2);
  EXPECT_EQ(round.mesh.vertices.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i)
    EXPECT_LT((round.normals[i].cast<double>() - round.mesh.vertices[i].normalized()).norm(), 1e-6);
}

TEST(MeshNormalsTest, OfObjBelongToCorners) {
  // Two triangles share an edge with different normals; the second has a corner without one.
  const Temporary file("corners.obj",
                       "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 0 1\nvn 0 1 0\n"
                       "f 1//1 2//1 3//1\nf 2//2 4 3//2\n");
  const MeshWithNormals mesh = read_mesh_with_normals(file.path(), std::nullopt);
  ASSERT_EQ(mesh.mesh.vertices.size(), 6u);
  const auto normal = [&](int triangle, int corner) { return mesh.normals[mesh.mesh.triangles[triangle][corner]]; };
  for (int corner = 0; corner < 3; ++corner) EXPECT_EQ(normal(0, corner), Eigen::Vector3f(0, 0, 1));
  EXPECT_EQ(normal(1, 0), Eigen::Vector3f(0, 1, 0));
  EXPECT_EQ(normal(1, 1), Eigen::Vector3f(0, 0, 0));
  EXPECT_EQ(read_mesh(file.path()).vertices.size(), 4u);
}

TEST(MeshNormalsTest, OfPlyMayBeMissing) {
  // Vertices with and without normals, and numbers that are too small for double precision.
  const std::string position = "property float x\nproperty float y\nproperty float z\n";
  for (const bool first : {true, false}) {
    const std::string with = "element vertex 1\n" + position + "property float nz\n",
                      without = "element vertex 2\n" + position;
    const Temporary file("mixed.ply", "ply\nformat ascii 1.0\n" + (first ? with + without : without + with) +
                                          "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
                                          (first ? "0 0 1e-400 1\n+1 0 0\n0 1 0\n" : "1 0 0\n0 1 0\n0 0 0 1\n") +
                                          "3 0 1 2\n");
    const MeshWithNormals mesh = read_mesh_with_normals(file.path(), std::nullopt);
    ASSERT_EQ(mesh.normals.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(mesh.normals[i].z(), mesh.mesh.vertices[i].isZero() ? 1 : 0) << i;
  }
}

}  // namespace
}  // namespace tensorray
