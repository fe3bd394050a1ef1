#pragma once
/// Boxes along the axes, and points.

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

namespace tensorray {

/// The smallest box that holds all points; empty if there are none.
template <class Vector>
Eigen::AlignedBox<typename Vector::Scalar, Vector::RowsAtCompileTime> box_of(const std::vector<Vector>& points) {
  Eigen::AlignedBox<typename Vector::Scalar, Vector::RowsAtCompileTime> box;
  for (const Vector& point : points) box.extend(point);
  return box;
}

/// The eight corners of a box after `transform`; bit k of a corner's index says that it is at the maximum of axis k.
inline std::vector<Eigen::Vector3d> corners_of(const Eigen::AlignedBox3d& box,
                                               const Eigen::Affine3d& transform = Eigen::Affine3d::Identity()) {
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i)
    corners.push_back(transform * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)));
  return corners;
}

/// Where the line at `from` + t `along` is in a box: from t = `first` to t = `second`; nowhere if they do not rise.
inline std::pair<double, double> section_in(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& from,
                                            const Eigen::Vector3d& along) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  double begin = -infinite, end = infinite;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = box.min()[axis] - from[axis], high = box.max()[axis] - from[axis];
    if (along[axis] != 0) {
      begin = std::max(begin, std::min(low / along[axis], high / along[axis]));
      end = std::min(end, std::max(low / along[axis], high / along[axis]));
    } else if (!(low <= 0 && high >= 0)) {
      return {infinite, -infinite};
    }
  }
  return {begin, end};
}

// The smallest rotation that turns one direction to another.

/// The smallest rotation of `from` to `to`, of any length; about any axis normal to them if they are opposite.
/// (Quaternion::FromTwoVectors does the same by a singular value decomposition, which takes seconds to compile.)
inline Eigen::Quaterniond turn_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const double cosine = b.dot(a);
  Eigen::Quaterniond turn;
  if (cosine < -1 + 1e-12) {
    turn.vec() = a.unitOrthogonal();
    turn.w() = 0;
    return turn;
  }
  const double twice = std::sqrt((1 + cosine) * 2);  // Twice the cosine of half of the angle.
  turn.vec() = a.cross(b) * (1 / twice);
  turn.w() = twice * 0.5;
  return turn;
}

}  // namespace tensorray
