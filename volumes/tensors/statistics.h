#pragma once
/// @file volumes/tensors/statistics.h
/// What `tensorray info` says of a field.

#include <array>
#include <cstddef>

#include <Eigen/Geometry>

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

struct FieldStatistics {
  std::size_t active_voxels = 0;
  std::size_t non_finite = 0;           ///< Voxels left out of all that follows.
  Eigen::AlignedBox3i index_box;        ///< Of the active voxels.
  Eigen::Vector3d voxel_size{0, 0, 0};  ///< Edge lengths, world units.
  Eigen::AlignedBox3d world_box;        ///< About the extent's corners, world.
  std::size_t memory_bytes = 0;         ///< Of the TensorField, in memory.

  static constexpr std::array<double, 7> percentiles{0, 1, 25, 50, 75, 99, 100};
  std::array<double, 7> norm{};       ///< Frobenius norm at those percentiles (nearest rank).
  double real_min = 0, real_max = 0;  ///< Real parts of all eigenvalues.
  double imaginary_max = 0;           ///< Greatest imaginary part.
  double complex_fraction = 0;        ///< Voxels with a complex pair (imaginary part above 1e-6 of the norm).
  double negative_fraction = 0;       ///< Voxels with an eigenvalue of negative real part (by 1e-6 of the norm).
  double asymmetry = 0;               ///< See asymmetry().
  double deviator_max = 0;            ///< Greatest ‖T − ⅓ tr(T) I‖₂, 1/length at scale 1.
  double absolute_loss = 0;           ///< What `absolute` would erase: EigenvalueReport::norm_lost.

  /// The largest stable step by Eq. 9, read dimensionally (s h ‖T − ⅓ tr(T) I‖₂ ≤ 1), world units; infinite for a
  /// field that does not bend light.
  double stable_step(double flexibility) const;
};

/// Runs on all threads.
FieldStatistics field_statistics(const TensorGrid& grid);

}  // namespace tensorray
