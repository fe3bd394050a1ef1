#pragma once
/// A point relative to a brick, so that single precision resolves 1e-6 of a voxel in a field of any size.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <Eigen/Core>

#include "volumes/bricks/tensor_field.h"

namespace tensorray {

struct BrickPoint {
  std::array<std::int32_t, 3> brick;  ///< Coordinates of a brick near the point, in bricks.
  std::array<float, 3> position;      ///< From the brick's first voxel, in voxels; may be outside the brick.
};

/// The position in index space.
inline Eigen::Vector3d index_position(const BrickPoint& point) {
  Eigen::Vector3d index;
  for (int axis = 0; axis < 3; ++axis)
    index[axis] = double{TensorBrick::cells} * point.brick[axis] + point.position[axis];
  return index;
}

/// The position from the first voxel of a brick, in voxels.
inline Eigen::Vector3f place_from(const Eigen::Vector3i& brick, const BrickPoint& point) {
  Eigen::Vector3f place;
  for (int axis = 0; axis < 3; ++axis)
    place[axis] = static_cast<float>(TensorBrick::cells * (point.brick[axis] - brick[axis])) + point.position[axis];
  return place;
}

/// The point at a position in index space. Its brick is the one that holds the nearest cell of the field's extent.
inline BrickPoint brick_point(const TensorField& field, const Eigen::Vector3d& index) {
  BrickPoint point;
  for (int axis = 0; axis < 3; ++axis) {
    const double first = field.voxels().min()[axis], last = std::max(first, field.voxels().max()[axis] - 1);
    const double cell = std::clamp(std::floor(index[axis]), first, last);
    point.brick[axis] = static_cast<std::int32_t>(std::floor(cell / TensorBrick::cells));
    point.position[axis] = static_cast<float>(index[axis] - double{TensorBrick::cells} * point.brick[axis]);
  }
  return point;
}

}  // namespace tensorray
