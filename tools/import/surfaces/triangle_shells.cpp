#include "tools/import/surfaces/triangle_shells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const Vector3d& corner(const TriangleMesh& mesh, std::size_t triangle, std::size_t k) {
  return mesh.vertices[mesh.triangles[triangle][k]];
}

/// The triangles as seen along the shortest axis of their box, in square bins.
class Columns {
 public:
  explicit Columns(const TriangleMesh& mesh) : mesh_(mesh), box_(mesh.bounds()) {
    box_.sizes().minCoeff(&axis_);
    side_ = std::clamp(static_cast<int>(std::sqrt(0.5 * static_cast<double>(mesh.triangles.size()))), 1, 2048);
    bins_.resize(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_));
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const Vector3d normal = area_of(mesh, i);
      if (!(std::abs(normal[axis_]) > 1e-9 * normal.norm())) continue;  // Is seen as a line.
      const Vector3d &a = corner(mesh, i, 0), &b = corner(mesh, i, 1), &c = corner(mesh, i, 2);
      const auto from = bin_at(a.cwiseMin(b).cwiseMin(c)), to = bin_at(a.cwiseMax(b).cwiseMax(c));
      for (int x = from[0]; x <= to[0]; ++x)
        for (int y = from[1]; y <= to[1]; ++y) bin(x, y).push_back(static_cast<std::uint32_t>(i));
    }
  }

  /// How many shells contain a point.
  int shells_at(const Vector3d& point) const {
    if (!box_.contains(point)) return 0;
    int sum = 0;
    const auto [x, y] = bin_at(point);
    for (const std::uint32_t triangle : bins_[static_cast<std::size_t>(x * side_ + y)]) {
      const double up = area_of(mesh_, triangle)[axis_];
      std::array<double, 3> turns{};
      for (std::size_t k = 0; k < 3; ++k)
        turns[k] = cross(flat(corner(mesh_, triangle, (k + 1) % 3)) - flat(corner(mesh_, triangle, k)),
                         flat(point) - flat(corner(mesh_, triangle, k)));
      if (!std::all_of(turns.begin(), turns.end(), [&](double turn) { return up > 0 ? turn >= 0 : turn < 0; }))
        continue;
      const double above = area_of(mesh_, triangle).dot(corner(mesh_, triangle, 0) - point) / up;
      if (above > 0) sum += up > 0 ? 1 : -1;
    }
    return sum;
  }

 private:
  /// Such that a triangle that looks up is counter-clockwise.
  Vector2d flat(const Vector3d& p) const { return {p[(axis_ + 1) % 3], p[(axis_ + 2) % 3]}; }
  static double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

  std::array<int, 2> bin_at(const Vector3d& p) const {
    const Vector2d at = side_ * (flat(p) - flat(box_.min())).cwiseQuotient(flat(box_.sizes()));
    return {std::clamp(static_cast<int>(at.x()), 0, side_ - 1), std::clamp(static_cast<int>(at.y()), 0, side_ - 1)};
  }
  std::vector<std::uint32_t>& bin(int x, int y) { return bins_[static_cast<std::size_t>(x * side_ + y)]; }

  const TriangleMesh& mesh_;
  Eigen::AlignedBox3d box_;
  int axis_ = 0, side_ = 1;
  std::vector<std::vector<std::uint32_t>> bins_;
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
  for (std::size_t i = 0, count = mesh.triangles.size(); i < count; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::array<std::uint32_t, 3> t = mesh.triangles[i];
      const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
      if (side(a) == 0 && side(b) * side(c) < 0) {
        mesh.triangles[i] = {a, b, cut(b, c)};
        mesh.triangles.push_back({a, cut(b, c), c});
        break;
      }
      if (!(side(a) * side(b) < 0 && side(a) * side(c) < 0)) continue;
      mesh.triangles[i] = {a, cut(a, b), cut(a, c)};
      mesh.triangles.push_back({cut(a, b), b, c});
      mesh.triangles.push_back({cut(a, b), c, cut(a, c)});
      break;
    }
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
  const Columns columns(shells);
  tbb::parallel_for(std::size_t{0}, inner.size(), [&](std::size_t i) {
    const Vector3d area = area_of(shells, i);
    if (!(area.norm() > 0)) return;
    const Vector3d &a = corner(shells, i, 0), &b = corner(shells, i, 1), &c = corner(shells, i, 2);
    // Not quite above the centroid, which others may have in common with it.
    const Vector3d above = 1e-3 * (area / std::sqrt(area.norm()) + 0.0137 * (b - a) + 0.0071 * (c - a));
    inner[i] = columns.shells_at((a + b + c) / 3 + above) > 0;
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
