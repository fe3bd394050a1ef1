#pragma once
/// @file tracing/steps/composition.h
/// Coefficients of `splitting4`, and the path between its steps, for both tracers.

#include <cmath>

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

namespace composition_detail {
constexpr double a1 = 0.0792036964311957, a2 = 0.353172906049774, a3 = -0.0420650803577195;
constexpr double a4 = 1 - 2 * (a1 + a2 + a3);
constexpr double b1 = 0.209515106613362, b2 = -0.143851773179818, b3 = 0.5 - (b1 + b2);
}  // namespace composition_detail

inline constexpr Composition splitting4_method = [] {
  using namespace composition_detail;
  Composition m{6, b3, {a1, a2, a3, a4, a3, a2, a1}, {b1, b2, b3, b3, b2, b1}, {}};
  for (int i = 0; i <= m.kicks; ++i) m.error[i] = m.drift[i];
  m.error[0] -= 1.0 / 6;
  m.error[m.kicks / 2] -= 4.0 / 6;
  m.error[m.kicks] -= 1.0 / 6;
  return m;
}();

/// `splitting`, as packets take it: without an error estimate.
inline constexpr Composition splitting_method{1, 1, {0.5, 0.5}, {1}, {}};

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
