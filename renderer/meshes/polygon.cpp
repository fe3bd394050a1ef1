#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>

#include "renderer/meshes/mesh_readers.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t max_concave_corners = 10000;  // Time grows with their square.

/// How often all corners may be searched without an ear, which takes the square of their number.
int max_searches(std::size_t corners) {
  return static_cast<int>(std::clamp(1e9 / (static_cast<double>(corners) * static_cast<double>(corners)), 8.0, 64.0));
}

/// Twice the vector area (Newell 1972).
Vector3d newell_normal(const std::vector<Vector3d>& corners) {
  Vector3d normal = Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    normal += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
  return normal;
}

/// The corners as seen against the normal, relative to the first one.
std::vector<Vector2d> projected(const std::vector<Vector3d>& corners, const Vector3d& normal) {
  const Vector3d u = normal.unitOrthogonal(), v = normal.normalized().cross(u);
  std::vector<Vector2d> result;
  for (const Vector3d& corner : corners)
    result.emplace_back((corner - corners[0]).dot(u), (corner - corners[0]).dot(v));
  return result;
}

/// Twice the area of a triangle; positive if it is counter-clockwise.
double corner_area(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

bool is_convex(const std::vector<Vector2d>& corners) {
  const std::size_t count = corners.size();
  for (std::size_t i = 0; i < count; ++i)
    if (!(corner_area(corners[i], corners[(i + 1) % count], corners[(i + 2) % count]) > 0)) return false;
  return true;
}

/// The corners that are left, as a ring.
class CornerRing {
 public:
  explicit CornerRing(const std::vector<Vector2d>& corners)
      : corners_(corners), left_(corners.size()), known_(corners.size(), Known::nothing) {
    std::iota(left_.begin(), left_.end(), 0);
  }

  std::size_t size() const { return left_.size(); }

  std::array<std::uint32_t, 3> triangle_at(std::size_t i) const {
    return {left_[(i + size() - 1) % size()], left_[i], left_[(i + 1) % size()]};
  }

  /// Removes corner i, an ear. Of the others, only its neighbours become an ear by that, or are one no longer, except
  /// where the polygon touches or crosses itself: a triangle that is no ear has a concave corner in it, which stays.
  void cut(std::size_t i) {
    left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(i));
    known_.erase(known_.begin() + static_cast<std::ptrdiff_t>(i));
    known_[i % size()] = known_[(i + size() - 1) % size()] = Known::nothing;
  }

  /// The next ear from corner `from` on, as far as is known; nothing if there is none.
  std::optional<std::size_t> next_ear(std::size_t from) {
    for (std::size_t i = 0; i < size(); ++i) {
      const std::size_t at = (from + i) % size();
      if (known_[at] == Known::nothing) known_[at] = is_ear(at) ? Known::ear : Known::no_ear;
      if (known_[at] == Known::ear) return at;
    }
    return std::nullopt;
  }

  void forget() { std::fill(known_.begin(), known_.end(), Known::nothing); }

 private:
  enum class Known : char { nothing, ear, no_ear };

  /// Whether the triangle at corner i has an area and no other corner in it or on its edges.
  bool is_ear(std::size_t i) const {
    const auto [p, q, r] = triangle_at(i);
    const Vector2d &a = corners_[p], &b = corners_[q], &c = corners_[r];
    if (!(corner_area(a, b, c) > 0)) return false;
    return std::none_of(left_.begin(), left_.end(), [&](std::uint32_t other) {
      const Vector2d& x = corners_[other];
      if (x == a || x == b || x == c) return false;  // Also its own corners. Outlines of holes repeat corners.
      return corner_area(a, b, x) >= 0 && corner_area(b, c, x) >= 0 && corner_area(c, a, x) >= 0;
    });
  }

  const std::vector<Vector2d>& corners_;
  std::vector<std::uint32_t> left_;
  std::vector<Known> known_;  ///< Of each of the corners that are left.
};

std::vector<std::array<std::uint32_t, 3>> fan(std::size_t corners) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::uint32_t i = 2; i < corners; ++i) triangles.push_back({0, i - 1, i});
  return triangles;
}

/// Triangles of a polygon, with the order of its corners; an index names a corner.
std::vector<std::array<std::uint32_t, 3>> triangulate(const std::vector<Vector3d>& corners) {
  const Vector3d normal = newell_normal(corners);
  if (corners.size() == 3 || !(normal.squaredNorm() > 0)) return fan(corners.size());
  const std::vector<Vector2d> flat = projected(corners, normal);
  if (is_convex(flat)) return fan(corners.size());
  if (corners.size() > max_concave_corners)
    throw std::runtime_error("a concave polygon has " + std::to_string(corners.size()) +
                             " corners; divide those with more than " + std::to_string(max_concave_corners));
  std::vector<std::array<std::uint32_t, 3>> triangles;
  CornerRing ring(flat);
  int searches = 0;
  for (std::size_t at = 0; ring.size() > 3;) {
    std::optional<std::size_t> ear = ring.next_ear(at);
    if (!ear && searches++ < max_searches(corners.size())) {
      ring.forget();
      ear = ring.next_ear(at);
    }
    at = ear.value_or(at % ring.size());  // Where there is no ear, any corner will do.
    triangles.push_back(ring.triangle_at(at));
    ring.cut(at);
  }
  triangles.push_back(ring.triangle_at(1));
  return triangles;
}

}  // namespace

void add_polygon(const std::vector<std::uint32_t>& corners, TriangleMesh& mesh) {
  std::vector<Vector3d> positions;
  for (const std::uint32_t corner : corners) positions.push_back(mesh.vertices[corner]);
  for (const auto& [a, b, c] : triangulate(positions)) mesh.triangles.push_back({corners[a], corners[b], corners[c]});
}

}  // namespace tensorray
