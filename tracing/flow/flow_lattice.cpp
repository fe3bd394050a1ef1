#include "tracing/flow/flow_lattice.h"

#include <algorithm>
#include <cmath>

namespace tensorray {
namespace {

constexpr int max_columns = 1 << 12;  // Number of first quads along a side.

bool is_parallelogram(const std::vector<Eigen::Vector2d>& polygon) {
  if (polygon.size() != 4) return false;
  const Eigen::Vector2d skew = polygon[0] - polygon[1] + polygon[2] - polygon[3];
  return skew.norm() < 1e-9 * (polygon[2] - polygon[0]).norm();
}

/// The place of a line of a lattice of `count` quads, in [0, 1].
/// @param at      In quads.
/// @param begins  Whether the lines of the first quad gather at its begin; likewise `ends` for the last one.
double graded(double at, int count, bool begins, bool ends) {
  const double first = ends && count == 1 ? 0.5 : 1, last = begins && count == 1 ? 0.5 : 1;  // Sizes of what is graded.
  const double left = count - at;
  if (begins && at < first)
    at = at * at / first;
  else if (ends && left < last)
    at = count - left * left / last;
  return at / count;
}

}  // namespace

std::vector<Patch> patches_of(const std::vector<Eigen::Vector2d>& polygon, double quad_size) {
  std::vector<Patch> patches;
  const std::size_t n = polygon.size();
  if (is_parallelogram(polygon)) {
    patches.push_back({{polygon[0], polygon[1], polygon[2], polygon[3]}, {true, true, true, true}});
  } else {
    Eigen::Vector2d center(0, 0);
    for (const Eigen::Vector2d& corner : polygon) center += corner / static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector2d &corner = polygon[i], &next = polygon[(i + 1) % n], &last = polygon[(i + n - 1) % n];
      patches.push_back({{(last + corner) / 2, corner, (corner + next) / 2, center}, {true, true, false, false}});
    }
  }
  for (Patch& patch : patches) {
    const auto count = [&](int a, int b, int c, int d) {
      const double length =
          std::max((patch.corners[b] - patch.corners[a]).norm(), (patch.corners[d] - patch.corners[c]).norm());
      return static_cast<int>(std::clamp(std::ceil(length / quad_size), 1.0, double{max_columns}));
    };
    patch.columns = count(0, 1, 3, 2);
    patch.rows = count(1, 2, 0, 3);
  }
  return patches;
}

double FlowLattice::u_of(std::uint32_t patch, std::uint32_t x) const {
  const Patch& p = patches[patch];
  return graded(std::ldexp(x, -levels), p.columns, is_graded && p.is_edge[3], is_graded && p.is_edge[1]);
}

double FlowLattice::v_of(std::uint32_t patch, std::uint32_t y) const {
  const Patch& p = patches[patch];
  return graded(std::ldexp(y, -levels), p.rows, is_graded && p.is_edge[0], is_graded && p.is_edge[2]);
}

bool FlowLattice::is_at_edge(const Quad& quad) const {
  const Patch& patch = patches[quad.patch];
  const std::uint32_t column = quad.x >> levels, row = quad.y >> levels;
  return (patch.is_edge[0] && row == 0) ||
         (patch.is_edge[1] && column + 1 == static_cast<std::uint32_t>(patch.columns)) ||
         (patch.is_edge[2] && row + 1 == static_cast<std::uint32_t>(patch.rows)) || (patch.is_edge[3] && column == 0);
}

}  // namespace tensorray
