#pragma once
/// @file base/geometry/turn.h
/// The smallest rotation that turns one direction to another.

#include <Eigen/Geometry>

namespace tensorray {

/// The smallest rotation of `from` to `to`, of any length; about any axis normal to them if they are opposite.
/// (Quaternion::FromTwoVectors does the same by a singular value decomposition, which takes seconds to compile.)
Eigen::Quaterniond turn_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace tensorray
