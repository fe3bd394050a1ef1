#pragma once
/// @file base/geometry/turn.h
/// The smallest rotation that turns one direction to another.

#include <cmath>

#include <Eigen/Geometry>

namespace tensorray {

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
