#include "tracing/steps/exponential.h"

#include <algorithm>
#include <cmath>

namespace tensorray {
namespace {

/// With k + 1 terms the power series of exp(A) is exact to 1e-12 for ‖A‖ up to entry k: (1e-12 (k + 2)!)^(1/(k + 2)).
/// This error is far below the single precision of the voxels.
constexpr double norm_of_terms[] = {1.4142e-06, 0.00018171, 0.0022133, 0.010371, 0.029937, 0.065257, 0.11903,
                                    0.19249,    0.28574,    0.3982,    0.52888,  0.67659,  0.84006,  1};
constexpr int max_terms = sizeof norm_of_terms / sizeof *norm_of_terms;

int terms_for(double squared_norm) {
  int terms = 1;
  while (terms < max_terms && squared_norm > norm_of_terms[terms - 1] * norm_of_terms[terms - 1]) ++terms;
  return terms;
}

/// exp(A) v by its power series. It uses scalars because this is the innermost loop of tracing.
Eigen::Vector3d series(const Eigen::Matrix3d& A, const Eigen::Vector3d& v, int terms) {
  constexpr double reciprocal[max_terms + 1] = {0,        1.0,      1.0 / 2,  1.0 / 3,  1.0 / 4,
                                                1.0 / 5,  1.0 / 6,  1.0 / 7,  1.0 / 8,  1.0 / 9,
                                                1.0 / 10, 1.0 / 11, 1.0 / 12, 1.0 / 13, 1.0 / 14};
  double x = v.x(), y = v.y(), z = v.z(), sum_x = x, sum_y = y, sum_z = z;
  for (int k = 1; k <= terms; ++k) {
    const double r = reciprocal[k];
    const double next_x = r * (A(0, 0) * x + A(0, 1) * y + A(0, 2) * z);
    const double next_y = r * (A(1, 0) * x + A(1, 1) * y + A(1, 2) * z);
    const double next_z = r * (A(2, 0) * x + A(2, 1) * y + A(2, 2) * z);
    sum_x += x = next_x;
    sum_y += y = next_y;
    sum_z += z = next_z;
  }
  return {sum_x, sum_y, sum_z};
}

/// exp(A) = result · exp(log_scale), for ‖A‖ = `norm` > 1, by scaling and squaring.
Eigen::Matrix3d squared(const Eigen::Matrix3d& A, double norm, double& log_scale) {
  const int halvings = std::ilogb(norm) + 1;
  const Eigen::Matrix3d small = std::ldexp(1.0, -halvings) * A;
  Eigen::Matrix3d power;
  for (int column = 0; column < 3; ++column)
    power.col(column) = series(small, Eigen::Vector3d::Unit(column), max_terms);
  log_scale = 0;
  for (int i = 0; i < halvings; ++i) {
    power = (power * power).eval();
    const double size = power.norm();
    power /= size;  // So that nothing overflows.
    log_scale = 2 * log_scale + std::log(size);
  }
  return power;
}

Eigen::Matrix3d deviator(const Eigen::Matrix3d& A) { return A - A.trace() / 3 * Eigen::Matrix3d::Identity(); }

/// exp(A) v by its power series, with its derivatives along two parameters. Columns are those of
/// `exponential_derivatives`.
Eigen::Matrix3d series(const Eigen::Matrix3d& A, const std::array<Eigen::Matrix3d, 2>& dA, const Eigen::Matrix3d& v,
                       int terms) {
  Eigen::Matrix3d term = v, sum = v;
  for (int k = 1; k <= terms; ++k) {
    Eigen::Matrix3d next = A * term;
    next.col(1) += dA[0] * term.col(0);
    next.col(2) += dA[1] * term.col(0);
    term = next / k;
    sum += term;
  }
  return sum;
}

}  // namespace

ExponentialDirection exponential_direction(const Eigen::Matrix3d& A, const Eigen::Vector3d& v) {
  // The trace of A changes only the length.
  const Eigen::Matrix3d without_trace = deviator(A);
  const double squared_norm = without_trace.squaredNorm();
  Eigen::Vector3d result;
  double log_scale = 0;
  if (squared_norm <= 1) {
    result = series(without_trace, v, terms_for(squared_norm));
  } else if (std::isfinite(squared_norm)) {
    result = squared(without_trace, std::sqrt(squared_norm), log_scale) * v;
  } else {
    return {};
  }
  const double length = result.norm();
  if (!(length > 0) || !std::isfinite(length)) return {};
  return {result / length, std::log(length) + log_scale};
}

Eigen::Matrix3d exponential_derivatives(const Eigen::Matrix3d& A, const std::array<Eigen::Matrix3d, 2>& dA,
                                        const Eigen::Matrix3d& v) {
  const Eigen::Matrix3d without_trace = deviator(A);
  const double squared_norm = without_trace.squaredNorm();
  // One more term, because differentiation of the series removes one.
  if (squared_norm <= 1) return series(without_trace, dA, v, std::min(terms_for(squared_norm) + 1, max_terms));
  const int halvings = std::isfinite(squared_norm) ? std::ilogb(std::sqrt(squared_norm)) + 1 : 0;
  const double part = std::ldexp(1.0, -halvings);
  const std::array<Eigen::Matrix3d, 2> small{part * dA[0], part * dA[1]};
  Eigen::Matrix3d power;
  std::array<Eigen::Matrix3d, 2> change;
  for (int column = 0; column < 3; ++column) {
    Eigen::Matrix3d unit = Eigen::Matrix3d::Zero();
    unit(column, 0) = 1;
    const Eigen::Matrix3d applied = series(part * without_trace, small, unit, max_terms);
    power.col(column) = applied.col(0);
    change[0].col(column) = applied.col(1);
    change[1].col(column) = applied.col(2);
  }
  for (int i = 0; i < halvings; ++i) {
    for (Eigen::Matrix3d& each : change) each = (power * each + each * power).eval();
    power = (power * power).eval();
    const double scale = 1 / power.norm();  // Only the direction is wanted, so that nothing overflows.
    power *= scale;
    for (Eigen::Matrix3d& each : change) each *= scale;
  }
  Eigen::Matrix3d result = power * v;
  for (int i = 0; i < 2; ++i) result.col(i + 1) += change[i] * v.col(0);
  return result;
}

}  // namespace tensorray
