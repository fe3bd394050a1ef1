#pragma once
/// @file volumes/tensors/eigenvalues.h
/// Preprocessing of tensors by their eigenvalues (Zheng and Pang 2003, Eq. 7), and the eigenvalues themselves.

#include <complex>
#include <cstddef>

#include <Eigen/Core>

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

enum class Eigenvalues {
  automatic,  ///< `absolute` where the field is symmetric (symmetric_tolerance), `raw` where it is not.
  raw,        ///< T as it is.
  absolute,   ///< E |Λ| E⁻¹. A complex pair r e^{±iφ} becomes r: its rotation is erased, and so is simple shear.
  positive,   ///< (T²)^½: flips what has a negative real part and keeps rotation.
};

/// What happened to the voxels of a field.
struct EigenvalueReport {
  Eigenvalues chosen = Eigenvalues::raw;  ///< Never `automatic`.
  std::size_t defective = 0;  ///< Voxels with (numerically) repeated eigenvalues of a non-diagonalisable tensor, or on
                              ///< the cut of `positive`.
  double norm_lost = 0;  ///< Σ erased_norm / Σ‖T‖²: how much of the field was rotation or shear; 0 for `raw`.
};

/// One tensor's `absolute` or `positive` (mode must be one of these). The result is real; where the function has no
/// value it is a limit: on a Jordan block of λ ≠ 0 ±T, of λ = 0 zero; on the cut of `positive` T. Near a nilpotent
/// block of three rows, where |·| is unbounded, the result fades to zero and its norm stays below 4 ‖T‖. Eigenvalues
/// within 1e-6 ‖T‖ of each other, or of an axis, count as being there: fields are single precision.
/// @param defective  If given, set to true where such a limit was taken, left alone elsewhere.
Eigen::Matrix3d with_eigenvalues(const Eigen::Matrix3d& tensor, Eigenvalues mode, bool* defective = nullptr);

/// What preprocessing erased of a tensor's squared norm: what its antisymmetric part (rotation, half of a simple shear)
/// and its symmetric part have less than before, each by itself, as `absolute` puts strain in the place of rotation.
double erased_norm(const Eigen::Matrix3d& before, const Eigen::Matrix3d& after);

/// Preprocesses every voxel in place, on all threads. Voxels must be finite.
EigenvalueReport apply_eigenvalues(TensorGrid& grid, Eigenvalues mode);

/// The eigenvalues of a tensor, sorted by falling real part. Exactly real where the tensor is symmetric.
Eigen::Vector3cd eigenvalues(const Eigen::Matrix3d& tensor);

}  // namespace tensorray
