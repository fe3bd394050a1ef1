#pragma once
/// The numbers that `tensorray info` prints about a field.

#include <array>
#include <vector>

#include <Eigen/Geometry>

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

struct FieldStatistics {
  std::size_t active_voxels = 0;              ///< Of all levels.
  std::vector<std::size_t> voxels_of_levels;  ///< Of each of them.
  std::size_t non_finite = 0;                 ///< Voxels that are not finite; all numbers below leave them out.
  Eigen::AlignedBox3i index_box;              ///< Box of the active voxels of level 0.
  Eigen::Vector3d voxel_size{0, 0, 0};        ///< Edge lengths, world units; of level 0.
  Eigen::AlignedBox3d world_box;              ///< Box of the corners of the extent, world space.
  std::size_t memory_bytes = 0;               ///< Size of the TensorField in memory.

  static constexpr std::array<double, 7> percentiles{0, 1, 25, 50, 75, 99, 100};
  std::array<double, 7> norm{};       ///< Frobenius norm at those percentiles (nearest rank).
  double real_min = 0, real_max = 0;  ///< Least and greatest real part of all eigenvalues.
  double imaginary_max = 0;           ///< Greatest imaginary part of all eigenvalues.
  double complex_fraction = 0;   ///< Fraction of voxels with a complex pair (imaginary part above 1e-6 of the norm).
  double negative_fraction = 0;  ///< Fraction of voxels with an eigenvalue of negative real part (by 1e-6 of the norm).
  double asymmetry = 0;          ///< As computed by asymmetry().
  double deviator_max = 0;       ///< Greatest ‖T − ⅓ tr(T) I‖₂, 1/length at scale 1.
  double absolute_loss = 0;      ///< EigenvalueReport::norm_lost, if `absolute` were applied.

  /// The largest stable step, world units, by Eq. 9 with consistent dimensions: s h ‖T − ⅓ tr(T) I‖₂ ≤ 1. Infinite for
  /// a field that does not bend light.
  double stable_step(double flexibility) const;
};

/// Runs on all threads.
FieldStatistics field_statistics(const TensorGrid& grid);

}  // namespace tensorray
