#pragma once
/// @file volumes/sampling/sample_tensors.h
/// The tensors at many points, in single precision, side by side.

#include <cstddef>

#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// Arrays have room for this count of points, as callers load and store vectors whole.
constexpr std::size_t sampled_room(std::size_t count) { return (count + 15) / 16 * 16; }

/// Points of index space. Single precision resolves 1e-7 of the distance from the brick.
struct IndexPoints {
  Eigen::Vector3i brick;     ///< Coordinates of a brick, in bricks.
  const float* position[3];  ///< From its first voxel, in voxels: an array for each axis, with `sampled_room`.
  std::size_t count;
};

/// Samples a field as TensorSampler does. Points outside the extent are moved to it. It is fastest if points next to
/// each other are in the same brick. The tensor at a point does not depend on the other points.
/// @param factor      All tensors are multiplied by it.
/// @param components  Component i (column by column) of the tensor at point p becomes components[i * stride + p].
/// @param stride      At least `sampled_room` of the count.
void sample_tensors(const TensorField& field, const IndexPoints& points, float factor, float* components,
                    std::size_t stride);

}  // namespace tensorray
