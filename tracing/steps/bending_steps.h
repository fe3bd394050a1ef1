#pragma once
/// One step along a bent ray by each of the methods, in double precision.

#include <array>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/LU>

#include "tracing/steps/exponential.h"
#include "tracing/steps/methods.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray::bending_steps {

/// The state of a ray at one point: the ray alone (N = 1), or with its derivatives along two parameters (N = 3). Column
/// 0 of P and V is the ray itself, the other columns are the derivatives. A method that is linear in states therefore
/// carries the derivatives along without extra code.
template <int N>
struct State {
  Eigen::Matrix<double, 3, N> P, V;
  double log_radiance_scale = 0;  ///< Λ: see RayBatch. Not computed by `splitting` and `splitting4` with N = 3.

  auto position() const { return P.template leftCols<1>(); }
  auto direction() const { return V.template leftCols<1>(); }
};

template <int N>
State<N> operator+(const State<N>& a, const State<N>& b) {
  return {a.P + b.P, a.V + b.V, a.log_radiance_scale + b.log_radiance_scale};
}
template <int N>
State<N> operator*(double factor, const State<N>& a) {
  return {factor * a.P, factor * a.V, factor * a.log_radiance_scale};
}

/// The field as one ray samples it.
template <int N>
struct RayMedium {
  TensorSampler& sampler;
  double strength;                              ///< σ = s · scale; V' is computed with σ T.
  Eigen::Matrix3d T = Eigen::Matrix3d::Zero();  ///< T as last sampled.
  std::array<Eigen::Matrix3d, N - 1> dT{};      ///< Derivatives of T along the parameters, as last sampled.

  void sample(const Eigen::Matrix<double, 3, N>& P) {
    if constexpr (N == 1) {
      T = sampler.at(P);
    } else {
      T = sampler.at(P.col(0), P.template rightCols<N - 1>(), dT);
    }
  }

  /// T V and its derivatives, with T as last sampled.
  Eigen::Matrix<double, 3, N> apply(const Eigen::Matrix<double, 3, N>& V) const {
    Eigen::Matrix<double, 3, N> TV = T * V;
    for (int i = 1; i < N; ++i) TV.col(i) += dT[i - 1] * V.col(0);
    return TV;
  }

  /// Eq. 5 and its derivatives (the variational equations). This form does not depend on the trace of T, even where V
  /// is not quite a unit vector (inside a step).
  State<N> derivative(const State<N>& at) {
    sample(at.P);
    Eigen::Matrix<double, 3, N> change = apply(at.V);
    const Eigen::Vector3d V = at.V.col(0), TV = change.col(0);
    const double squared = V.squaredNorm(), along = V.dot(TV) / squared;
    change.col(0) -= along * V;
    for (int i = 1; i < N; ++i) {
      const Eigen::Vector3d dV = at.V.col(i), dTV = change.col(i);
      const double change_along = (dV.dot(TV) + V.dot(dTV) - 2 * along * V.dot(dV)) / squared;
      change.col(i) -= along * dV + change_along * V;
    }
    return {at.V, strength * change, strength * (T.trace() - 3 * along)};
  }
};

/// Scales V to unit length and its derivatives with it. If V has no direction, the result is zero.
template <int N>
State<N> normalized(const State<N>& state) {
  const double length = state.direction().norm();
  if (!(length > 0) || !std::isfinite(length)) return {state.P, Eigen::Matrix<double, 3, N>::Zero(), 0};
  State<N> unit{state.P, state.V / length, state.log_radiance_scale};
  for (int i = 1; i < N; ++i) unit.V.col(i) -= unit.V.col(0).dot(unit.V.col(i)) * unit.V.col(0);
  return unit;
}

template <int N>
State<N> euler(RayMedium<N>& medium, const State<N>& from, double h) {
  medium.sample(from.P);
  const double factor = medium.strength * h;
  const Eigen::Matrix<double, 3, N> TV = medium.apply(from.V);
  const double change = factor * (medium.T.trace() - 3 * from.V.col(0).dot(TV.col(0)));
  const State<N> to = normalized<N>({from.P, from.V + factor * TV, from.log_radiance_scale + change});
  return {from.P + h * to.V, to.V, to.log_radiance_scale};
}

/// V ← exp(factor T) V, normalised, with T as last sampled.
template <int N>
void kick(const RayMedium<N>& medium, double factor, State<N>& ray) {
  if constexpr (N == 1) {
    const auto [V, log_length] = exponential_direction(factor * medium.T, ray.V);
    ray.V = V;
    ray.log_radiance_scale -= 3 * log_length;
  } else {
    const std::array<Eigen::Matrix3d, 2> dT{factor * medium.dT[0], factor * medium.dT[1]};
    ray.V = normalized<N>({ray.P, exponential_derivatives(factor * medium.T, dT, ray.V), 0}).V;
  }
}

/// A step of `splitting` or `splitting4`. Sets the position of `error`.
template <int N>
State<N> composed(const Composition& method, RayMedium<N>& medium, const State<N>& from, double h, State<N>& error) {
  State<N> ray = from;
  error.P = h * method.error[0] * ray.V;
  error.V.setZero();
  for (int i = 0; i < method.kicks; ++i) {
    ray.P += h * method.drift[i] * ray.V;
    medium.sample(ray.P);
    kick(medium, h * method.kick[i] * medium.strength, ray);
    error.P += h * method.error[i + 1] * ray.V;
  }
  ray.P += h * method.drift[method.kicks] * ray.V;
  return ray;
}

/// A step of a Runge–Kutta method. Adaptive methods set `error`.
template <int N>
State<N> by_stages(const RungeKutta& method, RayMedium<N>& medium, const State<N>& from, double h, State<N>& error) {
  std::array<State<N>, RungeKutta::max_stages> k;
  const auto along = [&](const double* factors, int count, State<N> to) {
    for (int j = 0; j < count; ++j)
      if (factors[j] != 0) to = to + h * factors[j] * k[j];
    return to;
  };
  for (int i = 0; i < method.stages; ++i) k[i] = medium.derivative(along(method.a[i], i, from));
  if (method.adaptive) {
    const auto zero = Eigen::Matrix<double, 3, N>::Zero();
    error = along(method.error, method.stages, {zero, zero, 0});
  }
  return normalized(along(method.b, method.stages, from));
}

/// A step of arc length h. Adaptive methods set `error`.
template <int N>
State<N> advance(BendingMethod method, RayMedium<N>& medium, const State<N>& from, double h, State<N>& error) {
  if (const RungeKutta* const stages = runge_kutta(method)) return by_stages(*stages, medium, from, h, error);
  if (method == BendingMethod::euler) return euler(medium, from, h);
  return composed(method == BendingMethod::splitting4 ? splitting4_method : splitting_method, medium, from, h, error);
}

}  // namespace tensorray::bending_steps
