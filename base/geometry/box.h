#pragma once
/// @file base/geometry/box.h
/// Boxes along the axes, and points.

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

}  // namespace tensorray
