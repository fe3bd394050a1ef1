#pragma once
/// The tensor at a point, in double precision; and at many points, in single precision, side by side.

#include <array>
#include <cstdint>
#include <utility>

#include <Eigen/Geometry>

#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// Samples a field, which must outlive the sampler. Cheap to make. Each thread needs its own, because a sampler caches
/// the last brick. A point outside the extent is moved to the nearest point of the extent; the tracer must check what
/// is inside.
class TensorSampler {
 public:
  explicit TensorSampler(const TensorField& field) : field_(&field) {}

  /// The field's interpolant at a world position, in world axes.
  Eigen::Matrix3d at(const Eigen::Vector3d& world);

  /// The same, with the derivatives of the interpolant along two world vectors, the columns of `along`. On the face of
  /// a cell of a linear field they are the derivatives on one side.
  Eigen::Matrix3d at(const Eigen::Vector3d& world, const Eigen::Matrix<double, 3, 2>& along,
                     std::array<Eigen::Matrix3d, 2>& derivatives);

  /// The distance from `world` along `direction` to the face of the brick, of the finest level, that contains `world`,
  /// if nothing bends light in that brick nor in the brick that was sampled last; otherwise 0. `direction` may have any
  /// length, which is the unit of the result.
  double way_through_straight_brick(const Eigen::Vector3d& world, const Eigen::Vector3d& direction);

  std::uint64_t samples() const { return samples_; }  ///< Calls of `at` so far.

  /// LeafBrick::scale of the brick that was sampled last.
  double scale() const { return scale_; }

  /// The greatest one since the last call.
  double take_finest_scale() { return std::exchange(finest_, scale_); }

 private:
  int locate(const Eigen::Vector3d& world, Eigen::Vector3d& fraction);
  void find_leaf(const Eigen::Vector3i& at, Eigen::Vector3i& cell, Eigen::Vector3d& fraction);

  const TensorField* field_;
  Eigen::Vector3i at_ = Eigen::Vector3i::Constant(INT32_MIN);  // Coordinates of `brick_`.
  TensorBrick brick_{};
  Eigen::Vector3d first_ = Eigen::Vector3d::Zero();  // LeafBrick::first, and its scale.
  double scale_ = 1, finest_ = 1;
  std::uint64_t samples_ = 0;
};

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
