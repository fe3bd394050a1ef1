#pragma once
/// The action of a matrix exponential on a direction.

#include <array>

#include <Eigen/Core>

namespace tensorray {

struct ExponentialDirection {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Unit, or zero.
  double log_length = 0;                                ///< ln |exp(A − ⅓ tr(A) I) v|; 0 if there is no direction.
};

/// normalize(exp(A) v) for any finite A, even where exp(A) itself would overflow. Exact to 1e-12 for ‖A‖ up to about 1;
/// above that, errors grow with ‖A‖ as with any such exponential. The direction is zero if exp(A) v has none (A or v is
/// not finite, or v is zero).
ExponentialDirection exponential_direction(const Eigen::Matrix3d& A, const Eigen::Vector3d& v);

/// exp(A) v and its derivatives along two parameters, all times the same c > 0.
/// @param dA  Derivatives of A along the two parameters.
/// @param v   Columns: v, and its derivatives along the parameters.
/// @return columns: c exp(A) v, and c times its derivatives, plus a multiple of the first column; not finite if A or v
/// is not.
Eigen::Matrix3d exponential_derivatives(const Eigen::Matrix3d& A, const std::array<Eigen::Matrix3d, 2>& dA,
                                        const Eigen::Matrix3d& v);

}  // namespace tensorray
