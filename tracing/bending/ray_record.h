#pragma once
/// @file tracing/bending/ray_record.h
/// Points of rays, and what `trace` records of a ray. Points of packets stay as the kernel has them, in single
/// precision: most of them are not needed, and converting them would take longer than tracing the ray.

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "volumes/bricks/brick_point.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// A point of a path.
struct PathPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< V; unit.
  double length = 0;                                    ///< Length of the path up to here, world units.
  bool in_field = false;  ///< Whether the path bends here (inside the volume and the cut).

  // Set by `set_tensors`; zero where light is straight.
  Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();  ///< T of the field here.
  Eigen::Vector3d change = Eigen::Vector3d::Zero();  ///< V' here, with σ·T. Its norm is the curvature of the path.

  Eigen::Vector3d force() const { return tensor * direction; }  ///< T V; its norm is Eq. 11.
};
using PathPoints = std::vector<PathPoint>;

/// A ray after a step in the field. The kernel writes each four numbers as one vector.
struct alignas(16) StepPoint {
  float position[3];   ///< From the first voxel of a brick, in voxels.
  float length;        ///< Length of the path since the ray entered the field, world units.
  float direction[3];  ///< V; unit within rounding, world axes.
  float padding;
  std::int32_t brick[3];  ///< Coordinates of the brick, in bricks.
  std::int32_t more_padding;

  BrickPoint place() const { return {{brick[0], brick[1], brick[2]}, {position[0], position[1], position[2]}}; }
};

/// The step as a point of the path, without its tensor.
/// @param entry_length  Length of the path where the ray entered the field.
PathPoint path_point(const TensorField& field, const StepPoint& step, double entry_length);

/// Points of a ray, from the start to the end. In the field there is one point for each step, from the entry to the
/// exit. A straight piece that ends on a surface has a point at each end. Where the ray enters or leaves the field
/// there are two points, one of them in the field. Empty if the ray meets nothing.
struct RayRecord {
  PathPoints before;             ///< The first points. If there are steps, the last one is the entry into the field.
  std::vector<StepPoint> steps;  ///< The points after them: steps of packets.
  PathPoints behind;             ///< The last points.

  std::size_t size() const { return before.size() + steps.size() + behind.size(); }
  void clear();  ///< Keeps the memory.
};

/// Point i of the ray, without its tensor.
PathPoint path_point(const TensorField& field, const RayRecord& record, std::size_t i);

}  // namespace tensorray
