#pragma once
/// @file volumes/bricks/tensor_sampler.h
/// The tensor at a point, in double precision.

#include <array>
#include <cstdint>

#include <Eigen/Geometry>

#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// Samples a field, which must outlive it. Cheap to make; one belongs to one thread (it remembers the last brick).
/// Points outside the extent are taken to the nearest point on it: the tracer knows what is inside.
class TensorSampler {
 public:
  explicit TensorSampler(const TensorField& field) : field_(&field) {}

  /// Trilinear interpolation at a world position, in world axes; inactive voxels count as zero.
  Eigen::Matrix3d at(const Eigen::Vector3d& world);

  /// The same, with the derivatives of the interpolation along two world vectors, the columns of `along`; at a cell's
  /// face those of one side.
  Eigen::Matrix3d at(const Eigen::Vector3d& world, const Eigen::Matrix<double, 3, 2>& along,
                     std::array<Eigen::Matrix3d, 2>& derivatives);

  /// If nothing bends light in the brick that was sampled last, nor in that of `world`, which may be the next one: how
  /// far it is from `world` out of the latter, where one goes along `direction` (of any length, which is the unit of
  /// the result). Otherwise 0.
  double way_through_straight_brick(const Eigen::Vector3d& world, const Eigen::Vector3d& direction);

  std::uint64_t samples() const { return samples_; }  ///< Calls of `at` so far.

 private:
  int locate(const Eigen::Vector3d& world, Eigen::Vector3d& fraction);

  const TensorField* field_;
  Eigen::Vector3i at_ = Eigen::Vector3i::Constant(INT32_MIN);  // Of the brick.
  TensorBrick brick_{};
  std::uint64_t samples_ = 0;
};

}  // namespace tensorray
