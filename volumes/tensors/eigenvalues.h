#pragma once
/// Preprocessing of tensors by their eigenvalues (Zheng and Pang 2003, Eq. 7), and the eigenvalues themselves.

#include <complex>
#include <string>

#include <Eigen/Core>

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// An entry of a grid's metadata: its tensors have changed their signs, which count therefore.
inline const std::string negated_key = "tensorray:negated";

enum class Eigenvalues {
  automatic,  ///< `absolute` where the field is symmetric (symmetric_tolerance) and not negated (negated_key), else
              ///< `raw`.
  raw,        ///< T as it is.
  absolute,   ///< E |Λ| E⁻¹. A complex pair r e^{±iφ} becomes r: its rotation is erased, and so is simple shear.
  positive,   ///< (T²)^½: flips the sign where the real part is negative, and keeps rotation.
};

/// What preprocessing did to the voxels of a field.
struct EigenvalueReport {
  Eigenvalues chosen = Eigenvalues::raw;  ///< Never `automatic`.
  std::size_t defective = 0;  ///< Voxels where a limit was taken (see with_eigenvalues): the tensor is (numerically)
                              ///< not diagonalisable, or on the cut of `positive`.
  double norm_lost = 0;  ///< Σ erased_norm / Σ‖T‖²: the part of the field (rotation, shear) that was erased;
                         ///< 0 for `raw`.
};

/// Computes `absolute` or `positive` of one tensor (`mode` must be one of these). The result is real. Where the
/// function has no value the result is a limit: ±T on a Jordan block with λ ≠ 0, zero on one with λ = 0, and T on the
/// cut of `positive` (a complex pair on the imaginary axis). Near a nilpotent block of three rows, where |·| is
/// unbounded, the result fades to zero, and its norm stays below 4 ‖T‖. Eigenvalues within 1e-6 ‖T‖ of each other count
/// as equal, and within 1e-6 ‖T‖ of an axis count as on it, because fields are in single precision.
/// @param defective  If given, set to true if such a limit was taken, and left unchanged otherwise.
Eigen::Matrix3d with_eigenvalues(const Eigen::Matrix3d& tensor, Eigenvalues mode, bool* defective = nullptr);

/// The part of a tensor's squared norm that preprocessing erased: the decrease of the antisymmetric part (rotation,
/// half of a simple shear) plus the decrease of the symmetric part. An increase counts as zero, because `absolute` may
/// replace rotation by strain.
double erased_norm(const Eigen::Matrix3d& before, const Eigen::Matrix3d& after);

/// What preprocessing did to some voxels, as sums.
struct EigenvalueSums {
  std::size_t defective = 0;
  double norm = 0, erased = 0;  ///< Σ‖T‖², Σ erased_norm.

  void add(const EigenvalueSums& other);
};

/// Preprocesses the active voxels of a block in place. Voxels must be finite. @param mode  `absolute` or `positive`.
EigenvalueSums apply_eigenvalues(TensorBlock& block, Eigenvalues mode);

/// @param sums  Of all voxels. @param chosen  What was done to them; `raw` has no sums.
EigenvalueReport report_of(const EigenvalueSums& sums, Eigenvalues chosen);

/// What `automatic` means for a field with this asymmetry.
Eigenvalues automatic_choice(double asymmetry);

/// The eigenvalues of a tensor, sorted by falling real part. They are exactly real if the tensor is symmetric.
Eigen::Vector3cd eigenvalues(const Eigen::Matrix3d& tensor);

}  // namespace tensorray
