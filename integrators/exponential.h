#pragma once
/// @file integrators/exponential.h
/// The action of a matrix exponential on a direction.

#include <Eigen/Core>

namespace tensorray {

/// normalize(exp(A) v) for any finite A, also where exp(A) itself would overflow. Exact to 1e-12 for ‖A‖ up to about 1;
/// beyond, errors grow with ‖A‖ as for any such exponential.
/// @return zero if exp(A) v has no direction (A or v is not finite, or v is zero).
Eigen::Vector3d exponential_direction(const Eigen::Matrix3d& A, const Eigen::Vector3d& v);

}  // namespace tensorray
