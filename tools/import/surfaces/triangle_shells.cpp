#include "tools/import/surfaces/triangle_shells.h"

#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>
#include <unsupported/Eigen/BVH>

namespace tensorray {
namespace {

using Eigen::Vector3d;

const Vector3d& corner(const TriangleMesh& mesh, std::size_t triangle, std::size_t k) {
  return mesh.vertices[mesh.triangles[triangle][k]];
}

/// Counts the shells that contain a point, from the triangles beyond it along an axis that a search in a tree of boxes
/// finds.
struct ShellCount {
  const TriangleMesh& mesh;
  int axis;
  Vector3d point;
  int count = 0;

  bool intersectVolume(const Eigen::AlignedBox3d& box) const {
    Vector3d lowest = box.min();
    lowest[axis] = point[axis];
    return (point.array() >= lowest.array()).all() && (point.array() <= box.max().array()).all();
  }

  /// @return false: the search goes on.
  bool intersectObject(std::uint32_t triangle) {
    const Vector3d area = area_of(mesh, triangle);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d from = point - corner(mesh, triangle, k);
      const double turn = (corner(mesh, triangle, (k + 1) % 3) - corner(mesh, triangle, k)).cross(from)[axis];
      if (area[axis] > 0 ? !(turn >= 0) : !(turn < 0)) return false;
    }
    if (area.dot(corner(mesh, triangle, 0) - point) / area[axis] > 0) count += area[axis] > 0 ? 1 : -1;
    return false;
  }
};

/// Divides the triangles that a plane across an axis cuts.
void divide(TriangleMesh& mesh, int axis, double position) {
  const auto side = [&](std::uint32_t vertex) { return mesh.vertices[vertex][axis] - position; };
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> cuts;
  const auto cut = [&](std::uint32_t a, std::uint32_t b) {
    if (a > b) std::swap(a, b);
    const auto [vertex, is_new] = cuts.try_emplace({a, b}, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (is_new) {
      const double part = side(a) / (side(a) - side(b));
      const Vector3d from = mesh.vertices[a], to = mesh.vertices[b];
      mesh.vertices.push_back(from + part * (to - from));
      mesh.vertices.back()[axis] = position;
    }
    return vertex->second;
  };
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)  // Also those that are added.
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh.triangles[i][k], b = mesh.triangles[i][(k + 1) % 3],
                          c = mesh.triangles[i][(k + 2) % 3];
      if (!(side(a) * side(b) < 0)) continue;
      mesh.triangles[i--] = {a, cut(a, b), c};
      mesh.triangles.push_back({cut(a, b), b, c});
      break;
    }
}

}  // namespace

Vector3d area_of(const TriangleMesh& shells, std::size_t triangle) {
  const Vector3d& a = corner(shells, triangle, 0);
  return 0.5 * (corner(shells, triangle, 1) - a).cross(corner(shells, triangle, 2) - a);
}

std::vector<char> inner_triangles(const TriangleMesh& shells) {
  std::vector<char> inner(shells.triangles.size(), 0);
  if (inner.empty()) return inner;
  Eigen::AlignedBox3d bounds;
  for (const Vector3d& vertex : shells.vertices) bounds.extend(vertex);
  int axis = 0;  // Along it, few triangles are in a row.
  bounds.sizes().minCoeff(&axis);
  std::vector<std::uint32_t> numbers;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (std::size_t i = 0; i < inner.size(); ++i) {
    const Vector3d area = area_of(shells, i);
    if (!(std::abs(area[axis]) > 1e-9 * area.norm())) continue;  // Is seen as a line.
    numbers.push_back(static_cast<std::uint32_t>(i));
    boxes.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) boxes.back().extend(corner(shells, i, k));
  }
  const Eigen::KdBVH<double, 3, std::uint32_t> tree(numbers.begin(), numbers.end(), boxes.begin(), boxes.end());
  tbb::parallel_for(std::size_t{0}, inner.size(), [&](std::size_t i) {
    const Vector3d area = area_of(shells, i);
    if (!(area.norm() > 0)) return;
    const Vector3d &a = corner(shells, i, 0), &b = corner(shells, i, 1), &c = corner(shells, i, 2);
    // Not quite above the centroid, which others may have in common with it.
    const Vector3d above = 1e-3 * (area / std::sqrt(area.norm()) + 0.0137 * (b - a) + 0.0071 * (c - a));
    ShellCount shells_at{shells, axis, (a + b + c) / 3 + above};
    Eigen::BVIntersect(tree, shells_at);
    inner[i] = shells_at.count > 0;
  });
  return inner;
}

TriangleMesh cut_to(TriangleMesh shells, const Eigen::AlignedBox3d& box) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double position : {box.min()[axis], box.max()[axis]}) divide(shells, axis, position);
  for (Vector3d& vertex : shells.vertices) vertex = vertex.cwiseMax(box.min()).cwiseMin(box.max());
  return shells;
}

}  // namespace tensorray
