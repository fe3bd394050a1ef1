#pragma once
/// @file integrators/bending_steps.h
/// One step along a bent ray, by each of the methods: a part of bending.cpp.

#include <array>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/LU>

#include "integrators/bending.h"
#include "integrators/exponential.h"
#include "volumes/tensor_sampler.h"

namespace tensorray::bending_steps {

/// A ray at a point of its way, or (N = 3) the ray and its derivatives along two parameters. Column 0 of P and V is the
/// ray itself, the others are the derivatives, so that a method that is linear in states carries them along as it is.
template <int N>
struct State {
  Eigen::Matrix<double, 3, N> P, V;

  auto position() const { return P.template leftCols<1>(); }
  auto direction() const { return V.template leftCols<1>(); }
};

template <int N>
State<N> operator+(const State<N>& a, const State<N>& b) {
  return {a.P + b.P, a.V + b.V};
}
template <int N>
State<N> operator*(double factor, const State<N>& a) {
  return {factor * a.P, factor * a.V};
}

/// The field as one ray meets it.
template <int N>
struct Medium {
  TensorSampler& sampler;
  double s;
  Eigen::Matrix3d T = Eigen::Matrix3d::Zero();  ///< As last sampled ...
  std::array<Eigen::Matrix3d, N - 1> dT{};      ///< ... and its derivatives along the parameters.

  void sample(const Eigen::Matrix<double, 3, N>& P) {
    if constexpr (N == 1) {
      T = sampler.at(P);
    } else {
      T = sampler.at(P.col(0), P.template rightCols<N - 1>(), dT);
    }
  }

  /// T V and its derivatives, with the tensor as last sampled.
  Eigen::Matrix<double, 3, N> apply(const Eigen::Matrix<double, 3, N>& V) const {
    Eigen::Matrix<double, 3, N> TV = T * V;
    for (int i = 1; i < N; ++i) TV.col(i) += dT[i - 1] * V.col(0);
    return TV;
  }

  /// Eq. 5, in a form that is blind to the trace of T also where V is not quite a unit vector (inside a step), and its
  /// derivatives (the variational equations).
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
    return {at.V, s * change};
  }
};

/// Takes V to unit length (and its derivatives with it); to zero if it has no direction.
template <int N>
State<N> normalized(const State<N>& state) {
  const double length = state.direction().norm();
  if (!(length > 0) || !std::isfinite(length)) return {state.P, Eigen::Matrix<double, 3, N>::Zero()};
  State<N> unit{state.P, state.V / length};
  for (int i = 1; i < N; ++i) unit.V.col(i) -= unit.V.col(0).dot(unit.V.col(i)) * unit.V.col(0);
  return unit;
}

template <int N>
State<N> euler(Medium<N>& medium, const State<N>& from, double h) {
  medium.sample(from.P);
  const State<N> to = normalized<N>({from.P, from.V + medium.s * h * medium.apply(from.V)});
  return {from.P + h * to.V, to.V};
}

template <int N>
State<N> splitting(Medium<N>& medium, const State<N>& from, double h) {
  const Eigen::Matrix<double, 3, N> middle = from.P + h / 2 * from.V;
  medium.sample(middle);
  const double factor = h * medium.s;
  if constexpr (N == 1) {
    const Eigen::Vector3d V = exponential_direction(factor * medium.T, from.V);
    return {middle + h / 2 * V, V};
  } else {
    const State<N> to = normalized<N>(
        {middle, exponential_derivatives(factor * medium.T, {factor * medium.dT[0], factor * medium.dT[1]}, from.V)});
    return {middle + h / 2 * to.V, to.V};
  }
}

template <int N>
State<N> rk4(Medium<N>& medium, const State<N>& from, double h) {
  const State<N> k1 = medium.derivative(from);
  const State<N> k2 = medium.derivative(from + h / 2 * k1);
  const State<N> k3 = medium.derivative(from + h / 2 * k2);
  const State<N> k4 = medium.derivative(from + h * k3);
  return normalized(from + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4));
}

/// Bogacki and Shampine 1989. `error` is the difference to the embedded method of order 2.
template <int N>
State<N> bs23(Medium<N>& medium, const State<N>& from, double h, State<N>& error) {
  const State<N> k1 = medium.derivative(from);
  const State<N> k2 = medium.derivative(from + h / 2 * k1);
  const State<N> k3 = medium.derivative(from + 3 * h / 4 * k2);
  const State<N> to = from + h * (2.0 / 9 * k1 + 1.0 / 3 * k2 + 4.0 / 9 * k3);
  const State<N> k4 = medium.derivative(to);
  error = h * (-5.0 / 72 * k1 + 1.0 / 12 * k2 + 1.0 / 9 * k3 + -1.0 / 8 * k4);
  return normalized(to);
}

/// Dormand and Prince 1980. `error` is the difference to the embedded method of order 4.
template <int N>
State<N> dopri5(Medium<N>& medium, const State<N>& from, double h, State<N>& error) {
  const State<N> k1 = medium.derivative(from);
  const State<N> k2 = medium.derivative(from + h * (1.0 / 5 * k1));
  const State<N> k3 = medium.derivative(from + h * (3.0 / 40 * k1 + 9.0 / 40 * k2));
  const State<N> k4 = medium.derivative(from + h * (44.0 / 45 * k1 + -56.0 / 15 * k2 + 32.0 / 9 * k3));
  const State<N> k5 = medium.derivative(
      from + h * (19372.0 / 6561 * k1 + -25360.0 / 2187 * k2 + 64448.0 / 6561 * k3 + -212.0 / 729 * k4));
  const State<N> k6 = medium.derivative(from + h * (9017.0 / 3168 * k1 + -355.0 / 33 * k2 + 46732.0 / 5247 * k3 +
                                                    49.0 / 176 * k4 + -5103.0 / 18656 * k5));
  const State<N> to =
      from + h * (35.0 / 384 * k1 + 500.0 / 1113 * k3 + 125.0 / 192 * k4 + -2187.0 / 6784 * k5 + 11.0 / 84 * k6);
  const State<N> k7 = medium.derivative(to);
  error = h * (71.0 / 57600 * k1 + -71.0 / 16695 * k3 + 71.0 / 1920 * k4 + -17253.0 / 339200 * k5 + 22.0 / 525 * k6 +
               -1.0 / 40 * k7);
  return normalized(to);
}

/// A step of arc length h. `error` is set by the adaptive methods.
template <int N>
State<N> advance(BendingMethod method, Medium<N>& medium, const State<N>& from, double h, State<N>& error) {
  switch (method) {
    case BendingMethod::euler:
      return euler(medium, from, h);
    case BendingMethod::rk4:
      return rk4(medium, from, h);
    case BendingMethod::bs23:
      return bs23(medium, from, h, error);
    case BendingMethod::dopri5:
      return dopri5(medium, from, h, error);
    case BendingMethod::splitting:
      break;
  }
  return splitting(medium, from, h);
}

}  // namespace tensorray::bending_steps
