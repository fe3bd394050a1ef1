#pragma once
/// @file integrators/bending/exponential.h
/// The action of a matrix exponential on a direction.

#include <array>

#include <Eigen/Core>

namespace tensorray {

/// normalize(exp(A) v) for any finite A, even where exp(A) itself would overflow. Exact to 1e-12 for ‖A‖ up to about 1;
/// above that, errors grow with ‖A‖ as with any such exponential.
/// @return zero if exp(A) v has no direction (A or v is not finite, or v is zero).
Eigen::Vector3d exponential_direction(const Eigen::Matrix3d& A, const Eigen::Vector3d& v);

/// exp(A) v and its derivatives along two parameters, all times the same c > 0.
/// @param dA  Derivatives of A along the two parameters.
/// @param v   Columns: v, and its derivatives along the parameters.
/// @return columns: c exp(A) v, and c times its derivatives, plus a multiple of the first column; not finite if A or v
/// is not.
Eigen::Matrix3d exponential_derivatives(const Eigen::Matrix3d& A, const std::array<Eigen::Matrix3d, 2>& dA,
                                        const Eigen::Matrix3d& v);

}  // namespace tensorray
