#include "integrators/exponential.h"

#include <cmath>

#include <Eigen/Geometry>

namespace tensorray {
namespace {

/// exp(A) X by its power series, to the rounding of double precision; for ‖A‖ <= `norm` <= 1.
template <class Operand>
Operand series(const Eigen::Matrix3d& A, double norm, const Operand& X) {
  Operand sum = X, term = X;
  double bound = 1;  // Of the term, relative to X.
  for (int k = 1; bound > 1e-17; ++k) {
    term = ((1.0 / k) * (A * term)).eval();
    sum += term;
    bound *= norm / k;
  }
  return sum;
}

}  // namespace

Eigen::Vector3d exponential_direction(const Eigen::Matrix3d& A, const Eigen::Vector3d& v) {
  // The trace only changes the length.
  Eigen::Matrix3d deviator = A;
  deviator.diagonal().array() -= A.trace() / 3;
  const double norm = deviator.norm();
  if (!std::isfinite(norm)) return Eigen::Vector3d::Zero();

  Eigen::Vector3d result;
  if (norm <= 1) {
    result = series(deviator, norm, v);
  } else {
    const int halvings = std::ilogb(norm) + 1;
    const Eigen::Matrix3d small = std::ldexp(1.0, -halvings) * deviator, identity = Eigen::Matrix3d::Identity();
    Eigen::Matrix3d power = series(small, 1.0, identity);
    for (int i = 0; i < halvings; ++i) {
      power = (power * power).eval();
      power /= power.norm();  // Only the direction is wanted, so that nothing overflows.
    }
    result = power * v;
  }
  const double length = result.norm();
  return length > 0 && std::isfinite(length) ? Eigen::Vector3d(result / length) : Eigen::Vector3d::Zero();
}

}  // namespace tensorray
