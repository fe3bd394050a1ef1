#pragma once
/// Numbers that describe a tensor and do not depend on the axes.

#include <string>
#include <vector>

#include <Eigen/Core>

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// T = S + A, with S symmetric and A antisymmetric. D = S − ⅓ tr(S) I is the deviator. ‖·‖ is the Frobenius norm.
/// Eigenvalues are ordered by their real parts.
enum class Invariant {
  norm,                   ///< ‖T‖.
  trace,                  ///< tr T.
  determinant,            ///< det T.
  fractional_anisotropy,  ///< √(3/2) ‖D‖ / ‖S‖ (Basser and Pierpaoli 1996): isotropic 0, planar √½, linear 1; up to
                          ///< √(3/2) if eigenvalues have different signs.
  mode,  ///< 3 √6 det(D / ‖D‖) (Criscione et al. 2000; Ennis and Kindlmann 2006): planar −1, linear 1.
  largest_eigenvalue,  ///< Real part of the largest eigenvalue of T.
  middle_eigenvalue,
  smallest_eigenvalue,
  von_mises,  ///< √(3/2) ‖D‖ (von Mises 1913): for a uniaxial stress, its size.
  max_shear,  ///< Half the difference of the greatest and the smallest eigenvalue of S (Tresca 1864).
  vorticity,  ///< Length of (T₃₂ − T₂₃, T₁₃ − T₃₁, T₂₁ − T₁₂) = √2 ‖A‖: for the gradient of a velocity (T_ij =
              ///< ∂v_i/∂x_j), the length of the curl, which is twice the angular velocity.
  swirling_strength,  ///< Greatest imaginary part of T's eigenvalues (Zhou et al. 1999).
  asymmetry,  ///< ‖T − Tᵀ‖ / ‖T‖: symmetric 0, antisymmetric 2. tensor_grid.h has the asymmetry of a field.
};

/// The names, in the order of the enumeration.
const std::vector<std::string>& invariant_names();

/// The invariant with that name.
/// @throw std::invalid_argument that lists the names if the name is unknown.
Invariant invariant_of(const std::string& name);

/// The value is finite for every finite tensor, even if intermediate results would overflow: a value beyond the range
/// of doubles becomes the nearest finite double. The zero tensor gives zero. A ratio is zero if its denominator (‖S‖ or
/// ‖D‖) is below 1e-6 ‖T‖, which is rounding error because fields are in single precision. Any thread may call it.
double invariant(Invariant which, const Eigen::Matrix3d& tensor);

/// The degree in f(c T) = c^degree f(T) for c > 0; 0 for a ratio. The unit of the invariant is the unit of the tensor
/// to that power.
int invariant_degree(Invariant which);

/// The unit of a tensor to the power of that degree; "1" of a ratio; empty: not known.
std::string units_of_power(const std::string& units, int degree);

/// The invariant at every active voxel of a field, which must be finite (see remove_non_finite). The name of the result
/// is the invariant's. Values beyond the range of single precision become the nearest finite float. Metadata are copied
/// from the field, and `tensorray:units`, if present, becomes the unit of the invariant. Runs on all threads.
/// Of a grid of several levels, that of level 0.
ScalarGrid invariant_grid(Invariant which, const TensorGrid& grid);

}  // namespace tensorray
