#pragma once
/// @file volumes/tensors/invariants.h
/// Numbers that describe a tensor, whatever the axes in which it is written.

#include <string>
#include <vector>

#include <Eigen/Core>

#include "volumes/grids/scalar_grid.h"

namespace tensorray {

/// T = S + A, its symmetric and antisymmetric parts; D = S − ⅓ tr(S) I, the deviator. ‖·‖ is Frobenius's norm, and
/// eigenvalues are ordered by their real parts.
enum class Invariant {
  norm,         ///< ‖T‖.
  trace,        ///< tr T.
  determinant,  ///< det T.
  fractional_anisotropy,  ///< √(3/2) ‖D‖ / ‖S‖ (Basser and Pierpaoli 1996): isotropic 0, plane √½, line 1; up to √(3/2)
                          ///< where eigenvalues have different signs.
  mode,  ///< 3 √6 det(D / ‖D‖) (Criscione et al. 2000; Ennis and Kindlmann 2006): plane −1, line 1.
  largest_eigenvalue,  ///< Real part of that one of T.
  middle_eigenvalue,
  smallest_eigenvalue,
  von_mises,  ///< √(3/2) ‖D‖ (von Mises 1913): of a stress in one direction, that stress.
  max_shear,  ///< Half the difference of the greatest and the smallest eigenvalue of S (Tresca 1864).
  vorticity,  ///< Length of (T₃₂ − T₂₃, T₁₃ − T₃₁, T₂₁ − T₁₂) = √2 ‖A‖: of a velocity's gradient
              ///< (T_ij = ∂v_i/∂x_j) the length of its curl, twice the angular velocity.
  swirling_strength,  ///< Greatest imaginary part of T's eigenvalues (Zhou et al. 1999).
  asymmetry,  ///< ‖T − Tᵀ‖ / ‖T‖: symmetric 0, antisymmetric 2. See tensor_grid.h for that of a field.
};

/// The names, in the order of the enumeration.
const std::vector<std::string>& invariant_names();

/// @throw std::invalid_argument listing the names if unknown.
Invariant invariant_of(const std::string& name);

/// Finite for every finite tensor, also where intermediate results would overflow: what is beyond the range of doubles
/// becomes its end. Zero of the zero tensor. Ratios whose denominator is rounding (‖S‖, or ‖D‖, below 1e-6 ‖T‖: fields
/// are single precision) are zero. Any thread may call it.
double invariant(Invariant which, const Eigen::Matrix3d& tensor);

/// The power of the tensor's unit that is the invariant's: f(c T) = c^degree f(T) for c > 0. 0: a ratio.
int invariant_degree(Invariant which);

/// The invariant at every active voxel of a field that is finite (see remove_non_finite), under the invariant's name.
/// What is beyond the range of single precision becomes its end. Metadata are the field's; `tensorray:units`, if it has
/// them, are the invariant's. Runs on all threads.
ScalarGrid invariant_grid(Invariant which, const TensorGrid& grid);

}  // namespace tensorray
