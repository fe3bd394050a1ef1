#include "renderer/coverage/planar_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace tensorray {
namespace {

using Eigen::Vector2d;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

Eigen::AlignedBox2d triangles_box(const PlanarMesh& mesh) {
  Eigen::AlignedBox2d box;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle) box.extend(mesh.vertices[vertex]);
  return box;
}

Vector2d center(const Eigen::AlignedBox2d& box) { return box.isEmpty() ? Vector2d::Zero().eval() : box.center(); }

double size(const Eigen::AlignedBox2d& box) {
  const double diagonal = box.isEmpty() ? 0 : box.diagonal().norm();
  return diagonal > 0 ? diagonal : 1;
}

/// A few roundings of the largest coordinate: points that callers compute on an edge are off it by this much. It is
/// more than the errors of `weights` below, so a point near a shared edge is in one of both.
double rounding_within(const Eigen::AlignedBox2d& box) {
  if (box.isEmpty()) return 0;
  return 16 * epsilon * box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
}

double planar_cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// The barycentric weights of a point that is in the triangle, or outside it by no more than the tolerance.
std::optional<Eigen::Vector3d> weights(const Vector2d& point, const std::array<Vector2d, 3>& corners,
                                       double tolerance) {
  // At an acute corner, the lines of both edges stay within the tolerance far beyond the triangle. The box does not.
  const Vector2d low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
  const Vector2d high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
  if ((point.array() < low.array() - tolerance).any() || (point.array() > high.array() + tolerance).any()) return {};

  const double area = planar_cross(corners[1] - corners[0], corners[2] - corners[0]);  // Twice the signed area.
  if (std::abs(area) <= 4 * epsilon * (high - low).squaredNorm()) return {};
  Eigen::Vector3d result;
  for (int i = 0; i < 3; ++i) {
    const Vector2d& start = corners[(i + 1) % 3];
    const Vector2d edge = corners[(i + 2) % 3] - start;
    const double inside =
        planar_cross(edge, point - start) * (area < 0 ? -1 : 1);  // Distance to the edge, times its length.
    if (!(inside >= -tolerance * edge.norm())) return {};
    result[i] = std::max(inside, 0.0);
  }
  return result / result.sum();
}

}  // namespace

PlanarMeshSearch::PlanarMeshSearch(const PlanarMesh& mesh)
    : mesh_(&mesh),
      box_(triangles_box(mesh)),
      size_(size(box_)),
      tolerance_(rounding_within(box_)),
      scene_(mesh.vertices, mesh.triangles, center(box_), size_) {}

/// Embree proposes triangles; double precision decides. A ray through the mesh would miss thin triangles, and edges
/// that single precision has moved. A box around the point allows for such errors.
void PlanarMeshSearch::find(const Vector2d& point, std::vector<PlanarHit>& hits) const {
  constexpr double single_precision = 1e-6;  // As a fraction of the mesh's size, with some margin.
  hits.clear();
  if (!(box_.squaredExteriorDistance(point) <= tolerance_ * tolerance_)) return;
  std::vector<TriangleId> candidates;
  candidates.reserve(16);
  scene_.near({point.x(), point.y(), 0}, single_precision * size_, candidates);
  for (const TriangleId& candidate : candidates) {
    const auto& [a, b, c] = mesh_->triangles[candidate.triangle];
    const auto found = weights(point, {mesh_->vertices[a], mesh_->vertices[b], mesh_->vertices[c]}, tolerance_);
    if (found) hits.push_back({candidate.triangle, *found});
  }
}

}  // namespace tensorray
