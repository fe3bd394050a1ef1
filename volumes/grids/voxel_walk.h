#pragma once
/// The voxels that a segment crosses, one after the other (J. Amanatides and A. Woo, A fast voxel traversal algorithm
/// for ray tracing, Eurographics 1987).

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "base/geometry/box.h"

namespace tensorray {

/// Calls `visit(voxel, from, to)` for each voxel that the segment from `a` to `b` crosses within `bounds`, in order.
/// The part of the segment in that voxel is from `from` to `to`, where 0 is `a` and 1 is `b`. Each part begins exactly
/// where the one before ends. Index space: voxel (i, j, k) is the cube of edge 1 about that point. Only voxels with a
/// centre in `bounds`, or the only voxel of an axis, are visited. A segment without length is one part in one voxel.
template <class Visit>
void walk_voxels(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::AlignedBox3d& bounds,
                 const Visit& visit) {
  constexpr double never = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d along = b - a;
  const auto [enters, leaves_at] = section_in(bounds, a, along);
  double from = std::max(0.0, enters);
  const double end = std::min(1.0, leaves_at);
  if (!(from < end)) return;

  const Eigen::Array3d least = (bounds.min().array() + 0.5).floor(), greatest = (bounds.max().array() - 0.5).ceil();
  Eigen::Array3d voxel = ((a + from * along).array() + 0.5).floor().max(least).min(greatest);
  // The last voxel within the bounds has no next one, so that rounding cannot lead out of the bounds.
  const auto leaves = [&](int axis) {
    if (along[axis] == 0 || voxel[axis] == (along[axis] > 0 ? greatest : least)[axis]) return never;
    return (voxel[axis] + std::copysign(0.5, along[axis]) - a[axis]) / along[axis];
  };
  Eigen::Array3d next(leaves(0), leaves(1), leaves(2));
  while (true) {
    int axis = 0;
    const double to = std::min(next.minCoeff(&axis), end);
    if (to > from) {
      visit(Eigen::Vector3i(voxel.cast<int>()), from, to);
      from = to;
    }
    if (!(next[axis] < end)) return;
    voxel[axis] += std::copysign(1.0, along[axis]);
    next[axis] = leaves(axis);
  }
}

}  // namespace tensorray
