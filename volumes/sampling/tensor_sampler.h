#pragma once
/// @file volumes/sampling/tensor_sampler.h
/// The tensor at a point, in double precision.

#include <array>
#include <cstdint>

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

  /// The distance from `world` along `direction` to the face of the brick that contains `world`, if nothing bends light
  /// in that brick nor in the brick that was sampled last; otherwise 0. `direction` may have any length, which is the
  /// unit of the result.
  double way_through_straight_brick(const Eigen::Vector3d& world, const Eigen::Vector3d& direction);

  std::uint64_t samples() const { return samples_; }  ///< Calls of `at` so far.

 private:
  int locate(const Eigen::Vector3d& world, Eigen::Vector3d& fraction);

  const TensorField* field_;
  Eigen::Vector3i at_ = Eigen::Vector3i::Constant(INT32_MIN);  // Coordinates of `brick_`.
  TensorBrick brick_{};
  std::uint64_t samples_ = 0;
};

}  // namespace tensorray
