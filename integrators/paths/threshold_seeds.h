#pragma once
/// @file integrators/paths/threshold_seeds.h
/// Seeds inside of the volume, where the tensor is of a kind.

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// Which tensors are wanted: those whose `value` is from `least` to `greatest`, both included; never NaN.
struct Threshold {
  std::function<double(const Eigen::Matrix3d&)> value;  ///< An invariant, say; called by several threads at once.
  double least = -std::numeric_limits<double>::infinity();
  double greatest = std::numeric_limits<double>::infinity();
};

/// Evenly spread in that part of the field's extent and of the world box `bounds` where the tensor (zero between
/// inactive voxels) is wanted: the first `count` points of a Sobol sequence there, of equal density everywhere. Runs on
/// all threads; the result does not depend on their number.
/// @throw std::invalid_argument if `count` is 0, the threshold is empty, or `bounds` does not meet the extent;
/// std::runtime_error, with the values that there are, if no point in 2²⁰ is wanted, or fewer than `count` in 2²⁶.
std::vector<Eigen::Vector3d> threshold_seeds(const TensorField& field, const Eigen::AlignedBox3d& bounds,
                                             const Threshold& threshold, std::uint64_t count, std::uint64_t seed);

}  // namespace tensorray
