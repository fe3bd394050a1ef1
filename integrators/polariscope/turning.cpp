#include "integrators/polariscope/turning.h"

// The code before HWY_AFTER_NAMESPACE is compiled once for each kind of processor. It calls no inline functions of
// other headers: the linker would keep only one of their copies, which may be compiled for the wrong processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "integrators/polariscope/turning.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// Must come after foreach_target.h:
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tensorray::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, ray_lanes>;
using F = hn::Vec<Floats>;

HWY_INLINE F set(double value) { return hn::Set(Floats(), static_cast<float>(value)); }
HWY_INLINE F load(const float* from) { return hn::LoadU(Floats(), from); }
HWY_INLINE void store(F value, float* to) { hn::StoreU(value, Floats(), to); }

struct Complex {
  F re, im;
};
HWY_INLINE Complex operator+(const Complex& a, const Complex& b) { return {a.re + b.re, a.im + b.im}; }
HWY_INLINE Complex operator-(const Complex& a, const Complex& b) { return {a.re - b.re, a.im - b.im}; }
HWY_INLINE Complex operator*(F a, const Complex& b) { return {a * b.re, a * b.im}; }
HWY_INLINE Complex operator*(const Complex& a, const Complex& b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
HWY_INLINE Complex conjugate(const Complex& a) { return {a.re, hn::Neg(a.im)}; }

struct Series {
  Complex u[4], v[4];
};

HWY_INLINE Series load_series(const RayTurns& turns, int at) {
  const auto part = [&](int c, int m) HWY_ATTR {
    return Complex{load(turns.series[c][m][0] + at), load(turns.series[c][m][1] + at)};
  };
  return {{part(0, 0), part(0, 1), part(0, 2), part(0, 3)}, {part(1, 0), part(1, 1), part(1, 2), part(1, 3)}};
}

HWY_INLINE void store_series(const Series& s, RayTurns& turns, int at) {
  for (int c = 0; c < 2; ++c)
    for (int m = 0; m < 4; ++m) {
      store(c == 0 ? s.u[m].re : s.v[m].re, turns.series[c][m][0] + at);
      store(c == 0 ? s.u[m].im : s.v[m].im, turns.series[c][m][1] + at);
    }
}

/// The series of a step's exponential. The square of its angle is p g² + r g⁴; the cosine, and the sine over the angle,
/// are series in that.
HWY_INLINE Series series_of(F alpha, F beta, F gamma) {
  const F p = alpha * alpha + beta * beta, r = gamma * gamma, pp = p * p;
  const F cosine[4] = {set(-1 / 2.0) * p, set(1 / 24.0) * pp - set(1 / 2.0) * r,
                       p * (set(1 / 12.0) * r - set(1 / 720.0) * pp),
                       pp * (set(1 / 40320.0) * pp - set(1 / 240.0) * r) + set(1 / 24.0) * r * r};
  const F sine[4] = {set(1), set(-1 / 6.0) * p, set(1 / 120.0) * pp - set(1 / 6.0) * r,
                     p * (set(1 / 60.0) * r - set(1 / 5040.0) * pp)};
  Series s;
  for (int m = 0; m < 4; ++m) {
    s.u[m] = {cosine[m], gamma * sine[m]};
    s.v[m] = {alpha * sine[m], hn::Neg(beta) * sine[m]};
  }
  return s;
}

/// The product of quaternions as far as the series go; `p` is that of the later turn.
HWY_INLINE Series product(const Series& p, const Series& q) {
  Series result;
#pragma GCC unroll 4
  for (int m = 0; m < 4; ++m) {
    Complex u = p.u[m] + q.u[m], v = p.v[m] + q.v[m];
#pragma GCC unroll 4
    for (int j = 0; j <= m; ++j) u = u - conjugate(p.v[j]) * q.v[m - j];
#pragma GCC unroll 4
    for (int j = 0; j < m; ++j) {
      u = u + p.u[j] * q.u[m - 1 - j];
      v = v + conjugate(p.u[j]) * q.v[m - 1 - j] + p.v[j] * q.u[m - 1 - j];
    }
    result.u[m] = u;
    result.v[m] = v;
  }
  return result;
}

/// Adds steps to `open`, or, if any turn would be too great, sets `next` to them. @return whether they are added.
bool add_to(const RaySteps& steps, float greatest, RayTurns& open, RayTurns& next) {
  const Floats d;
  const F most = set(0.75);  // Of the angle: 0.75⁹ / 9! is 2e-7.
  bool fits = true;
  for (int at = 0; at < ray_lanes; at += static_cast<int>(hn::Lanes(d))) {
    const F h = load(steps.length + at);  // Times a and b first: alone, its square may be beyond single precision.
    const F a1 = h * load(steps.a[0] + at), b1 = h * load(steps.b[0] + at);
    const F a2 = h * load(steps.a[1] + at), b2 = h * load(steps.b[1] + at);
    const F alpha = set(0.5) * (a1 + a2), beta = set(0.5) * (b1 + b2), gamma = set(gauss_point) * (a2 * b1 - a1 * b2);
    const F z = set(greatest) * gamma, angle = set(greatest) * hn::Sqrt(alpha * alpha + beta * beta + z * z);
    F part = set(1), squares = set(0);
    for (int n = 0; n < 120 && !hn::AllFalse(d, hn::Gt(part * angle, most)); ++n) {
      const auto halves = hn::Gt(part * angle, most);
      part = hn::IfThenElse(halves, part * set(0.5), part);
      squares = hn::IfThenElse(halves, squares + set(1), squares);
    }
    fits = fits && hn::AllFalse(d, hn::Gt(load(open.angle + at) + angle, most));
    store_series(series_of(part * alpha, part * beta, part * gamma), next, at);
    store(angle, next.angle + at);
    store(squares, next.squares + at);
  }
  for (int at = 0; fits && at < ray_lanes; at += static_cast<int>(hn::Lanes(d))) {
    store_series(product(load_series(next, at), load_series(open, at)), open, at);
    store(load(open.angle + at) + load(next.angle + at), open.angle + at);
  }
  return fits;
}

/// The sum of c_m G^m. @param c  Of a ray.
HWY_INLINE Complex sum_of(const float (&c)[4][2][ray_lanes], std::size_t ray, F G) {
  Complex sum{set(c[3][0][ray]), set(c[3][1][ray])};
  for (int m = 2; m >= 0; --m) sum = G * sum + Complex{set(c[m][0][ray]), set(c[m][1][ray])};
  return sum;
}

void take_turns(const RayTurns* turns, std::size_t count, std::size_t ray, const float* strengths, std::size_t room,
                float* planes) {
  const F zero = set(0), two = set(2);
  for (std::size_t at = 0; at < room; at += hn::Lanes(Floats())) {
    const F g = load(strengths + at), G = g * g;
    Complex U{set(1), zero}, V{zero, zero};
    for (const RayTurns* turn = turns; turn != turns + count; ++turn) {
      if (turn->angle[ray] == 0) continue;
      Complex u = G * sum_of(turn->series[0], ray, G), v = g * sum_of(turn->series[1], ray, G);
      for (float n = 0; n < turn->squares[ray]; ++n) {  // With w − 1 for w, which has few digits of small angles.
        const F twice = two * u.re + two;
        u = {u.re * (twice + two), twice * u.im};
        v = twice * v;
      }
      u.re = u.re + set(1);
      const Complex first = U;
      U = u * first - conjugate(v) * V;
      V = conjugate(u) * V + v * first;
    }
    const F scale = set(1) / hn::Sqrt(U.re * U.re + U.im * U.im + V.re * V.re + V.im * V.im);
    const F q[4] = {U.re, V.re, hn::Neg(V.im), U.im};
    for (std::size_t c = 0; c < 4; ++c) store(q[c] * scale, planes + c * room + at);
  }
}

void add_all(const float* planes, float weight, std::size_t room, float* rotations) {
  for (std::size_t at = 0; at < room; at += hn::Lanes(Floats())) {
    const F one = set(weight), two = set(2 * weight), w = load(planes + at), x = load(planes + room + at);
    const F y = load(planes + 2 * room + at), z = load(planes + 3 * room + at);
    const F entries[9] = {one - two * (y * y + z * z), two * (x * y - w * z),       two * (x * z + w * y),
                          two * (x * y + w * z),       one - two * (x * x + z * z), two * (y * z - w * x),
                          two * (x * z - w * y),       two * (y * z + w * x),       one - two * (x * x + y * y)};
    for (std::size_t i = 0; i < 9; ++i) store(load(rotations + i * room + at) + entries[i], rotations + i * room + at);
  }
}

}  // namespace
}  // namespace tensorray::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

HWY_EXPORT(add_to);
HWY_EXPORT(take_turns);
HWY_EXPORT(add_all);

void add_steps(const RaySteps& steps, double greatest, std::vector<RayTurns>& turns) {
  RayTurns next;
  if (turns.empty()) turns.emplace_back();
  if (!HWY_DYNAMIC_DISPATCH(add_to)(steps, static_cast<float>(greatest), turns.back(), next)) turns.push_back(next);
}

void turn(const std::vector<RayTurns>& turns, std::size_t ray, const float* strengths, std::size_t room,
          float* planes) {
  HWY_DYNAMIC_DISPATCH(take_turns)(turns.data(), turns.size(), ray, strengths, room, planes);
}

void add_rotations(const float* planes, float weight, std::size_t room, float* rotations) {
  HWY_DYNAMIC_DISPATCH(add_all)(planes, weight, room, rotations);
}

}  // namespace tensorray
#endif
