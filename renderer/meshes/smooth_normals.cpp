#include <array>
#include <cmath>
#include <map>

#include <Eigen/Geometry>

#include "renderer/meshes/mesh.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr double angle_rounding = 1e-6;  // Of the cosine of an angle between triangles, so that 90° smooths a cube.

/// A corner of a triangle.
struct TriangleCorner {
  std::uint32_t triangle = 0;
  int number = 0;
  Vector3d normal = Vector3d::Zero();  ///< The triangle's, unit.
  double angle = 0;
};

TriangleCorner triangle_corner(const TriangleMesh& mesh, std::uint32_t triangle, int number) {
  const auto& t = mesh.triangles[triangle];
  const Vector3d& here = mesh.vertices[t[number]];
  const Vector3d to_next = mesh.vertices[t[(number + 1) % 3]] - here,
                 to_last = mesh.vertices[t[(number + 2) % 3]] - here;
  const Vector3d cross = to_next.cross(to_last);
  return {triangle, number, cross.stableNormalized(), std::atan2(cross.norm(), to_next.dot(to_last))};
}

std::vector<std::vector<TriangleCorner>> corners_by_vertex(const TriangleMesh& mesh) {
  std::vector<std::vector<TriangleCorner>> corners(mesh.vertices.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    for (int number = 0; number < 3; ++number)
      corners[mesh.triangles[i][number]].push_back(triangle_corner(mesh, i, number));
  return corners;
}

Eigen::Vector3f mean_normal(const TriangleCorner& corner, const std::vector<TriangleCorner>& around,
                            double min_cosine) {
  Vector3d sum = Vector3d::Zero();
  for (const TriangleCorner& other : around)
    if (corner.normal.dot(other.normal) >= min_cosine) sum += other.angle * other.normal;
  return sum.normalized().cast<float>();
}

}  // namespace

MeshWithNormals with_smooth_normals(const TriangleMesh& mesh, double angle) {
  const double min_cosine = std::cos(angle) - angle_rounding;
  MeshWithNormals result;
  result.mesh.triangles.resize(mesh.triangles.size());
  const auto corners = corners_by_vertex(mesh);
  for (std::size_t vertex = 0; vertex < mesh.vertices.size(); ++vertex) {
    std::map<std::array<float, 3>, std::uint32_t> made;  // The normals of this vertex.
    for (const TriangleCorner& corner : corners[vertex]) {
      const Eigen::Vector3f normal = mean_normal(corner, corners[vertex], min_cosine);
      const auto [entry, is_new] =
          made.try_emplace({normal.x(), normal.y(), normal.z()}, static_cast<std::uint32_t>(result.normals.size()));
      result.mesh.triangles[corner.triangle][corner.number] = entry->second;
      if (!is_new) continue;
      result.mesh.vertices.push_back(mesh.vertices[vertex]);
      result.normals.push_back(normal);
    }
  }
  return result;
}

}  // namespace tensorray
