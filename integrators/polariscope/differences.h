#pragma once
/// @file integrators/polariscope/differences.h
/// a = u·T u − w·T w and b = u·(T + Tᵀ) w at many points. These two are linear in T: the coefficients of a brick become
/// those of a and b, so that a point takes a quarter of the time of a tensor.

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "volumes/bricks/tensor_field.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {

class DifferenceSampler {
 public:
  /// @param field   Must outlive it. @param factor  a and b are multiplied by it.
  DifferenceSampler(const TensorField& field, const Eigen::Vector3d& u, const Eigen::Vector3d& w, double factor);

  /// At points of index space; those outside the extent are moved to it. It is fastest if points next to each other are
  /// in the same brick. The result at a point does not depend on the others, nor on earlier calls.
  void sample(const std::vector<Eigen::Vector3d>& points, std::vector<float>& a, std::vector<float>& b);

 private:
  const float* coefficients_of(const TensorBrick& brick);
  void sample_cubic(const std::vector<Eigen::Vector3d>& points, std::vector<float>& a, std::vector<float>& b);

  const TensorField& field_;
  Eigen::Matrix3d to_a_, to_b_;  // a = Σ to_a_ij T_ij.
  /// Bricks that were converted last, each at a place that its address chooses: a and b of each coefficient.
  struct Converted {
    const float* of = nullptr;
    std::vector<float> values;
  };
  std::vector<Converted> converted_;
};

}  // namespace tensorray
