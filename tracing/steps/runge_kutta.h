#pragma once
/// @file tracing/steps/runge_kutta.h
/// Coefficients of the Runge–Kutta methods.

#include "tracing/bending/bending.h"

namespace tensorray {

/// An explicit method: stage i is at x + h Σ_j a[i][j] k_j, and the step ends at x + h Σ_j b[j] k_j.
struct RungeKutta {
  static constexpr int max_stages = 7;

  int stages, order;
  double a[max_stages][max_stages];
  double b[max_stages];
  bool adaptive;
  double error[max_stages];  ///< Adaptive methods: h Σ_j error[j] k_j is the difference from the embedded method.
};

inline constexpr RungeKutta rk4_method{/*stages*/ 4,
                                       /*order*/ 4,
                                       /*a*/ {{}, {1.0 / 2}, {0, 1.0 / 2}, {0, 0, 1}},
                                       /*b*/ {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6},
                                       /*adaptive*/ false,
                                       /*error*/ {}};

/// Bogacki and Shampine 1989; the embedded method is of order 2.
inline constexpr RungeKutta bs23_method{/*stages*/ 4,
                                        /*order*/ 3,
                                        /*a*/ {{}, {1.0 / 2}, {0, 3.0 / 4}, {2.0 / 9, 1.0 / 3, 4.0 / 9}},
                                        /*b*/ {2.0 / 9, 1.0 / 3, 4.0 / 9},
                                        /*adaptive*/ true,
                                        /*error*/ {-5.0 / 72, 1.0 / 12, 1.0 / 9, -1.0 / 8}};

/// Dormand and Prince 1980; the embedded method is of order 4.
inline constexpr RungeKutta dopri5_method{
    /*stages*/ 7,
    /*order*/ 5,
    /*a*/
    {{},
     {1.0 / 5},
     {3.0 / 40, 9.0 / 40},
     {44.0 / 45, -56.0 / 15, 32.0 / 9},
     {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
     {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
     {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}},
    /*b*/ {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
    /*adaptive*/ true,
    /*error*/ {71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40}};

/// The coefficients of a method; null if it is not a Runge–Kutta method.
inline const RungeKutta* runge_kutta(BendingMethod method) {
  switch (method) {
    case BendingMethod::rk4:
      return &rk4_method;
    case BendingMethod::bs23:
      return &bs23_method;
    case BendingMethod::dopri5:
      return &dopri5_method;
    case BendingMethod::euler:
    case BendingMethod::automatic:
    case BendingMethod::splitting:
    case BendingMethod::splitting4:
      break;
  }
  return nullptr;
}

/// Whether an error estimate sets the lengths of steps. @param step  BendingSettings::step.
inline bool is_adaptive(BendingMethod method, double step) {
  const RungeKutta* const stages = runge_kutta(method);
  return (stages && stages->adaptive) || (method == BendingMethod::splitting4 && step == 0);
}

}  // namespace tensorray
