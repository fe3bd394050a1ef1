#pragma once
/// @file integrators/bending/path_points.h
/// Points of a path with the tensor of the field.

#include <vector>

#include "integrators/bending/ray_record.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// A point of a path.
struct PathPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< V; unit.
  double length = 0;                                    ///< Length of the path up to here, world units.
  Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();     ///< T of the field here; zero where light is straight.
  Eigen::Vector3d change = Eigen::Vector3d::Zero();     ///< V' here, with σ·T. Its norm is the curvature of the path.
  bool in_field = false;  ///< Whether the path bends here (inside the volume and the cut).

  Eigen::Vector3d force() const { return tensor * direction; }  ///< T V; its norm is Eq. 11.
};
using PathPoints = std::vector<PathPoint>;

/// The point of a path where a ray has been; `tensor` and `change` are zero.
PathPoint path_point(const RayPoint& point);

/// Sets `tensor` and `change` of the points in the field, in double precision.
/// @param strength  σ = s · scale of light in the path's direction.
void set_tensors(const TensorField& field, double strength, PathPoints& points);

}  // namespace tensorray
