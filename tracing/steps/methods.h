#pragma once
/// Coefficients of the methods, the lengths of their steps, and the path between the ends of a step, for both tracers.

#include <cmath>

#include "tracing/bending/bending.h"

namespace tensorray {

/// The symmetric composition of order 4 with six kicks, S6, of S. Blanes and P. C. Moan (Practical symplectic
/// partitioned Runge–Kutta and Runge–Kutta–Nyström methods, J. Comput. Appl. Math. 142, 2002). Drifts and kicks
/// alternate, and begin and end with a drift. Negative ones are small.
struct Composition {
  static constexpr int max_kicks = 6;

  int kicks;
  double longest_kick;
  double drift[max_kicks + 1], kick[max_kicks];

  /// The error estimate is the difference between the way along the drifts and that by Simpson's rule, from the
  /// directions at the beginning, in the middle and at the end: h Σ_j error[j] V_j. It falls with h^3.5 or faster and
  /// is ten times the error of the step or more.
  double error[max_kicks + 1];
};

inline constexpr Composition splitting4_method = [] {
  constexpr double a1 = 0.0792036964311957, a2 = 0.353172906049774, a3 = -0.0420650803577195;
  constexpr double a4 = 1 - 2 * (a1 + a2 + a3);
  constexpr double b1 = 0.209515106613362, b2 = -0.143851773179818, b3 = 0.5 - (b1 + b2);
  Composition m{6, b3, {a1, a2, a3, a4, a3, a2, a1}, {b1, b2, b3, b3, b2, b1}, {}};
  for (int i = 0; i <= m.kicks; ++i) m.error[i] = m.drift[i];
  m.error[0] -= 1.0 / 6;
  m.error[m.kicks / 2] -= 4.0 / 6;
  m.error[m.kicks] -= 1.0 / 6;
  return m;
}();

/// `splitting` is the same with one kick, and without an error estimate.
inline constexpr Composition splitting_method{1, 1, {0.5, 0.5}, {1}, {}};

/// An explicit method: stage i is at x + h Σ_j a[i][j] k_j, and the step ends at x + h Σ_j b[j] k_j.
struct RungeKutta {
  static constexpr int max_stages = 7;

  int stages, order;
  double a[max_stages][max_stages];
  double b[max_stages];
  bool adaptive;
  double error[max_stages];  ///< Adaptive methods: h Σ_j error[j] k_j is the difference from the embedded method.
};

inline constexpr RungeKutta rk4_method{
    4, 4, {{}, {1.0 / 2}, {0, 1.0 / 2}, {0, 0, 1}}, {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6}, false, {}};

/// Bogacki and Shampine 1989; the embedded method is of order 2.
inline constexpr RungeKutta bs23_method{4,
                                        3,
                                        {{}, {1.0 / 2}, {0, 3.0 / 4}, {2.0 / 9, 1.0 / 3, 4.0 / 9}},
                                        {2.0 / 9, 1.0 / 3, 4.0 / 9},
                                        true,
                                        {-5.0 / 72, 1.0 / 12, 1.0 / 9, -1.0 / 8}};

/// Dormand and Prince 1980; the embedded method is of order 4.
inline constexpr RungeKutta dopri5_method{
    7,
    5,
    {{},
     {1.0 / 5},
     {3.0 / 40, 9.0 / 40},
     {44.0 / 45, -56.0 / 15, 32.0 / 9},
     {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
     {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
     {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}},
    {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
    true,
    {71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40}};

/// The coefficients of a method; null if it is not a Runge–Kutta method.
inline const RungeKutta* runge_kutta(BendingMethod method) {
  if (method == BendingMethod::rk4) return &rk4_method;
  if (method == BendingMethod::bs23) return &bs23_method;
  return method == BendingMethod::dopri5 ? &dopri5_method : nullptr;
}

/// Whether an error estimate sets the lengths of steps. @param step  BendingSettings::step.
inline bool is_adaptive(BendingMethod method, double step) {
  const RungeKutta* const stages = runge_kutta(method);
  return (stages && stages->adaptive) || (method == BendingMethod::splitting4 && step == 0);
}

/// Limits of step lengths, in voxels.
namespace step_lengths {

constexpr double longest_automatic = 0.5;
constexpr double shortest_splitting = 1.0 / 64;  ///< Of automatic steps; splitting is stable in any field.
constexpr double strongest_kick = 0.2;           ///< Limit of |σ| h ‖T − ⅓ tr(T) I‖ in an automatic step.
constexpr double longest_adaptive = 2;           ///< So that no step passes over a voxel.
constexpr double shortest_adaptive = 1e-6;
constexpr double longest_composed = 6;        ///< Of automatic steps of `splitting4`: its samples are then 2.1 apart.
constexpr double longest_into_finer = 2.001;  ///< As a part of the longest step of a finer leaf into which it leads.
constexpr double strongest_composed = 1.25;   ///< As strongest_kick, for its first step.

/// A step through a brick where nothing bends light ends this far beyond the brick. Otherwise rounding could keep the
/// ray in it. The second value is for methods that also sample at the end of a step.
constexpr double past_straight_brick = 1.0 / 64, past_straight_brick_by_stages = 1e-5;

/// The next step of an adaptive method is the last step times safety · excess^(-1 / order), limited to the range from
/// min_growth to max_growth. `excess` is the error of the last step divided by the tolerance. If it is NaN, the
/// factor is min_growth.
constexpr double safety = 0.9, min_growth = 0.2, max_growth = 5;
constexpr double composed_safety = 0.7;  ///< Of `splitting4`: steps are then hardly ever repeated, so that rays depend
                                         ///< smoothly on their start and flexibility.
constexpr int composed_order = 4;
constexpr double min_excess = 1e-10;  ///< Smaller values of `excess` count as this one.

}  // namespace step_lengths

/// Number of pieces into which a recorded step is divided. Each is one voxel long or shorter. @param length  Voxels.
inline int pieces_of(double length) { return length > 1 ? static_cast<int>(std::ceil(length - 1e-3)) : 1; }

/// Number of chords that stay within 0.02 voxels of the path, for surfaces that light may meet.
/// @param length, turn  Of the step: voxels, and the distance of the directions at its ends.
inline int chords_of(double length, double turn) {
  const double squares = length * turn / 8 / 0.02;
  return squares < 1 ? 1 : squares < 1024 ? static_cast<int>(std::ceil(std::sqrt(squares))) : 32;
}

/// Weights of the positions at both ends of a step and, times its length h, of the directions there. They give the path
/// at the part t of the step. This is a cubic: its error is a hundredth of that of a chord in steps of two voxels, and
/// falls with h⁴.
struct PathWeights {
  double from, from_direction, to, to_direction;
};
constexpr PathWeights path_weights(double t) {
  const double u = 1 - t;
  return {u * u * (1 + 2 * t), t * u * u, t * t * (3 - 2 * t), -t * t * u};
}
/// The derivatives of these weights by t.
constexpr PathWeights path_slopes(double t) {
  return {6 * t * (t - 1), (1 - t) * (1 - 3 * t), 6 * t * (1 - t), t * (3 * t - 2)};
}

}  // namespace tensorray
