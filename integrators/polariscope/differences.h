#pragma once
/// a = u·T u − w·T w and b = u·(T + Tᵀ) w at the Gauss points of steps. These two are linear in T: the coefficients of
/// a brick become those of a and b. Rays side by side are mostly in one cell, whose coefficients are loaded once.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "integrators/polariscope/turning.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// The cells that points may be in, and how they are found; along each axis.
struct CellBox {
  double along[3];   ///< Of the rays, index space.
  double first[3];   ///< Index space.
  double extent[3];  ///< Voxels of level 0.
  double scale;      ///< Cells in a voxel of level 0.
  std::int32_t last[3];
};

/// One thread's. It keeps the bricks that it converted last.
class DifferenceSampler {
 public:
  /// @param field   Must outlive it. @param along  Of the rays, index space. @param factor  Of a and b.
  DifferenceSampler(const TensorField& field, const Eigen::Vector3d& along, const Eigen::Vector3d& u,
                    const Eigen::Vector3d& w, double factor);

  /// Sets a and b of the rays that have a step, and those of others to 0. Points outside the extent are moved to it.
  /// The result does not depend on earlier calls.
  void sample(RaySteps& steps);

  /// Of a cell of the finest voxels: the first of the 4³ coefficients that are in use there; null: they are 0. A
  /// fraction of the cell, times `scale` plus `offset`, is one of the coefficients' cell.
  struct Cell {
    const float* first;
    float scale, offset[3];
  };
  Cell find(const std::int32_t (&cell)[3]);

 private:
  const float* coefficients_of(const TensorBrick& brick);

  const TensorField& field_;
  int finest_;             // The finest level, ...
  Eigen::Vector3i first_;  // ... and its first voxel.
  Eigen::Vector3d along_;
  Eigen::Matrix3d to_a_, to_b_;  // a = Σ to_a_ij T_ij.
  /// Bricks that were converted last, each at a place that its address chooses: a and b of each coefficient.
  struct Converted {
    const float* of = nullptr;
    std::vector<float> values;
  };
  std::vector<Converted> converted_;
  Eigen::Vector3i at_ = Eigen::Vector3i::Constant(INT32_MIN);  // The brick of `values_`.
  const float* values_ = nullptr;
};

}  // namespace tensorray
