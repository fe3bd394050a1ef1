#pragma once
/// @file integrators/seeds/threshold_seeds.h
/// Seeds inside the volume at points where an invariant of the tensor lies in a range.

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// Selects the tensors whose `value` is from `least` to `greatest`, both included. NaN is never selected.
struct Threshold {
  std::function<double(const Eigen::Matrix3d&)> value;  ///< For example an invariant. Several threads call it at once.
  double least = -std::numeric_limits<double>::infinity();
  double greatest = std::numeric_limits<double>::infinity();
};

/// Points of equal density in the part of the field's extent and of the world box `bounds` where the threshold selects
/// the tensor (inactive voxels count as zero; sampled in single precision): the first `count` points of a Sobol
/// sequence there. Runs on all threads; the result does not depend on their number.
/// @throw std::invalid_argument if `count` is 0, the threshold is empty, or `bounds` does not meet the extent;
/// std::runtime_error, with the range of the values found, if none of 2²⁰ points is selected, or fewer than `count` of
/// 2²⁶.
std::vector<Eigen::Vector3d> threshold_seeds(const TensorField& field, const Eigen::AlignedBox3d& bounds,
                                             const Threshold& threshold, std::uint64_t count, std::uint64_t seed);

}  // namespace tensorray
