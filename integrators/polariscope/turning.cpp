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

/// a b + c, and the same with the conjugate of a.
HWY_INLINE Complex mul_add(const Complex& a, const Complex& b, const Complex& c) {
  return {hn::MulAdd(a.re, b.re, hn::NegMulAdd(a.im, b.im, c.re)),
          hn::MulAdd(a.re, b.im, hn::MulAdd(a.im, b.re, c.im))};
}
HWY_INLINE Complex conjugate_mul_add(const Complex& a, const Complex& b, const Complex& c) {
  return {hn::MulAdd(a.re, b.re, hn::MulAdd(a.im, b.im, c.re)),
          hn::MulAdd(a.re, b.im, hn::NegMulAdd(a.im, b.re, c.im))};
}
HWY_INLINE Complex add(const Complex& a, const Complex& b) { return {hn::Add(a.re, b.re), hn::Add(a.im, b.im)}; }
HWY_INLINE Complex negative(const Complex& a) { return {hn::Neg(a.re), hn::Neg(a.im)}; }

struct Series {
  Complex u[4], v[4];
};

HWY_INLINE Series load_series(const RayTurns& turns, int at) {
  Series s;
  for (int m = 0; m < 4; ++m) {
    s.u[m] = {load(turns.series[0][m][0] + at), load(turns.series[0][m][1] + at)};
    s.v[m] = {load(turns.series[1][m][0] + at), load(turns.series[1][m][1] + at)};
  }
  return s;
}

HWY_INLINE void store_series(const Series& s, RayTurns& turns, int at) {
  for (int m = 0; m < 4; ++m) {
    store(s.u[m].re, turns.series[0][m][0] + at);
    store(s.u[m].im, turns.series[0][m][1] + at);
    store(s.v[m].re, turns.series[1][m][0] + at);
    store(s.v[m].im, turns.series[1][m][1] + at);
  }
}

/// The series of a step's exponential. The square of its angle is p g² + r g⁴; the cosine, and the sine over the angle,
/// are series in that.
HWY_INLINE Series series_of(F alpha, F beta, F gamma) {
  const F p = hn::MulAdd(alpha, alpha, hn::Mul(beta, beta)), r = hn::Mul(gamma, gamma);
  const F pp = hn::Mul(p, p), pr = hn::Mul(p, r), ppp = hn::Mul(pp, p);
  const F fourth = hn::MulAdd(set(-1 / 240.0), hn::Mul(p, pr), hn::Mul(set(1 / 24.0), hn::Mul(r, r)));
  const F cosine[4] = {hn::Mul(set(-1 / 2.0), p), hn::MulAdd(set(1 / 24.0), pp, hn::Mul(set(-1 / 2.0), r)),
                       hn::MulAdd(set(-1 / 720.0), ppp, hn::Mul(set(1 / 12.0), pr)),
                       hn::MulAdd(set(1 / 40320.0), hn::Mul(pp, pp), fourth)};
  const F sine[4] = {set(1), hn::Mul(set(-1 / 6.0), p), hn::MulAdd(set(1 / 120.0), pp, hn::Mul(set(-1 / 6.0), r)),
                     hn::MulAdd(set(-1 / 5040.0), ppp, hn::Mul(set(1 / 60.0), pr))};
  Series s;
  for (int m = 0; m < 4; ++m) {
    s.u[m] = {cosine[m], hn::Mul(gamma, sine[m])};
    s.v[m] = {hn::Mul(alpha, sine[m]), hn::Mul(hn::Neg(beta), sine[m])};
  }
  return s;
}

/// The product of quaternions as far as the series go; `p` is that of the later turn.
HWY_INLINE Series product(const Series& p, const Series& q) {
  Series result;
#pragma GCC unroll 4
  for (int m = 0; m < 4; ++m) {
    Complex u = add(p.u[m], q.u[m]), v = add(p.v[m], q.v[m]);
#pragma GCC unroll 4
    for (int j = 0; j < m; ++j) {
      u = mul_add(p.u[j], q.u[m - 1 - j], u);
      v = conjugate_mul_add(p.u[j], q.v[m - 1 - j], mul_add(p.v[j], q.u[m - 1 - j], v));
    }
#pragma GCC unroll 4
    for (int j = 0; j <= m; ++j) u = conjugate_mul_add(negative(p.v[j]), q.v[m - j], u);
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
    const F h = load(steps.length + at), half = hn::Mul(set(0.5), h);
    const F a1 = load(steps.a[0] + at), b1 = load(steps.b[0] + at);
    const F a2 = load(steps.a[1] + at), b2 = load(steps.b[1] + at);
    const F alpha = hn::Mul(half, hn::Add(a1, a2)), beta = hn::Mul(half, hn::Add(b1, b2));
    const F gamma = hn::Mul(hn::Mul(set(gauss_point), hn::Mul(h, h)), hn::MulSub(a2, b1, hn::Mul(a1, b2)));
    const F z = hn::Mul(set(greatest), gamma), squared = hn::MulAdd(alpha, alpha, hn::Mul(beta, beta));
    const F angle = hn::Mul(set(greatest), hn::Sqrt(hn::MulAdd(z, z, squared)));
    F part = set(1), squares = set(0);
    for (int n = 0; n < 120 && !hn::AllFalse(d, hn::Gt(hn::Mul(part, angle), most)); ++n) {
      const auto halves = hn::Gt(hn::Mul(part, angle), most);
      part = hn::IfThenElse(halves, hn::Mul(part, set(0.5)), part);
      squares = hn::IfThenElse(halves, hn::Add(squares, set(1)), squares);
    }
    fits = fits && hn::AllFalse(d, hn::Gt(hn::Add(load(open.angle + at), angle), most));
    store_series(series_of(hn::Mul(part, alpha), hn::Mul(part, beta), hn::Mul(part, gamma)), next, at);
    store(angle, next.angle + at);
    store(squares, next.squares + at);
  }
  for (int at = 0; fits && at < ray_lanes; at += static_cast<int>(hn::Lanes(d))) {
    store_series(product(load_series(next, at), load_series(open, at)), open, at);
    store(hn::Add(load(open.angle + at), load(next.angle + at)), open.angle + at);
  }
  return fits;
}

/// The sum of c_m G^m. @param c  Of a ray.
HWY_INLINE Complex sum_of(const float (&c)[4][2][ray_lanes], std::size_t ray, F G) {
  Complex sum{set(c[3][0][ray]), set(c[3][1][ray])};
  for (int m = 2; m >= 0; --m)
    sum = {hn::MulAdd(sum.re, G, set(c[m][0][ray])), hn::MulAdd(sum.im, G, set(c[m][1][ray]))};
  return sum;
}

void take_turns(const RayTurns* turns, std::size_t count, std::size_t ray, const float* strengths, std::size_t room,
                float* planes) {
  const F zero = set(0), two = set(2);
  for (std::size_t at = 0; at < room; at += hn::Lanes(Floats())) {
    const F g = load(strengths + at), G = hn::Mul(g, g);
    Complex U{set(1), zero}, V{zero, zero};
    for (const RayTurns* turn = turns; turn != turns + count; ++turn) {
      if (turn->angle[ray] == 0) continue;
      const Complex even = sum_of(turn->series[0], ray, G), odd = sum_of(turn->series[1], ray, G);
      Complex u{hn::Mul(G, hn::Neg(even.re)), hn::Mul(G, even.im)}, v{hn::Mul(g, odd.re), hn::Mul(g, odd.im)};
      for (float n = 0; n < turn->squares[ray]; ++n) {  // With 1 − w for w, which has few digits of small angles.
        const F twice = hn::NegMulAdd(two, u.re, two);
        u = {hn::Mul(hn::Add(u.re, u.re), hn::Sub(two, u.re)), hn::Mul(twice, u.im)};
        v = {hn::Mul(twice, v.re), hn::Mul(twice, v.im)};
      }
      u.re = hn::Sub(set(1), u.re);
      const Complex none{zero, zero}, first = U;
      U = mul_add(u, first, conjugate_mul_add(negative(v), V, none));
      V = conjugate_mul_add(u, V, mul_add(v, first, none));
    }
    const F squares = hn::MulAdd(V.re, V.re, hn::MulAdd(V.im, V.im, hn::MulAdd(U.re, U.re, hn::Mul(U.im, U.im))));
    const F scale = hn::Div(set(1), hn::Sqrt(squares)), q[4] = {U.re, V.re, hn::Neg(V.im), U.im};
    for (std::size_t c = 0; c < 4; ++c) store(hn::Mul(q[c], scale), planes + c * room + at);
  }
}

void add_all(const float* planes, float weight, std::size_t room, float* rotations) {
  for (std::size_t at = 0; at < room; at += hn::Lanes(Floats())) {
    const F one = set(weight), twice = set(2 * weight), w = load(planes + at), x = load(planes + room + at);
    const F y = load(planes + 2 * room + at), z = load(planes + 3 * room + at);
    const F w2 = hn::Mul(w, twice), x2 = hn::Mul(x, twice), y2 = hn::Mul(y, twice), z2 = hn::Mul(z, twice);
    const F xy = hn::Mul(x2, y), xz = hn::Mul(x2, z), yz = hn::Mul(y2, z);
    const F xx = hn::Mul(x2, x), yy = hn::Mul(y2, y), zz = hn::Mul(z2, z);
    const F entries[9] = {hn::Sub(one, hn::Add(yy, zz)), hn::NegMulAdd(w2, z, xy),      hn::MulAdd(w2, y, xz),
                          hn::MulAdd(w2, z, xy),         hn::Sub(one, hn::Add(xx, zz)), hn::NegMulAdd(w2, x, yz),
                          hn::NegMulAdd(w2, y, xz),      hn::MulAdd(w2, x, yz),         hn::Sub(one, hn::Add(xx, yy))};
    for (std::size_t i = 0; i < 9; ++i)
      store(hn::Add(load(rotations + i * room + at), entries[i]), rotations + i * room + at);
  }
}

void sum_all(const float* planes, std::size_t count, const float* colors, std::size_t room, float* sums) {
  const Floats d;
  for (std::size_t i = 0; i < 3 * count; ++i) {
    F sum = set(0);
    for (std::size_t at = 0; at < room; at += hn::Lanes(d))
      sum = hn::MulAdd(load(planes + i / 3 * room + at), load(colors + i % 3 * room + at), sum);
    sums[i] = hn::GetLane(hn::SumOfLanes(d, sum));
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
HWY_EXPORT(sum_all);

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

void sum_colors(const float* planes, std::size_t count, const float* colors, std::size_t room, float* sums) {
  HWY_DYNAMIC_DISPATCH(sum_all)(planes, count, colors, room, sums);
}

}  // namespace tensorray
#endif
