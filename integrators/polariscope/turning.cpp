#include "integrators/polariscope/turning.h"

#include <cstddef>

// The code before HWY_AFTER_NAMESPACE is compiled once for each kind of processor. It calls no inline functions of
// other headers: the linker would keep only one of their copies, which may be compiled for the wrong processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "integrators/polariscope/turning.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// Must come after foreach_target.h:
#include <hwy/highway.h>

#ifndef TENSORRAY_INTEGRATORS_TURNING
#define TENSORRAY_INTEGRATORS_TURNING
namespace tensorray {
namespace {

constexpr float most_angle = 0.75f;  // Of a turn, for the greatest strength: 0.75^9 / 9! is 2e-7.
constexpr int most_squares = 120;    // Of a step with a greater angle.

}  // namespace
}  // namespace tensorray
#endif

HWY_BEFORE_NAMESPACE();
namespace tensorray::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 16>;
using F = hn::Vec<Floats>;

HWY_INLINE F set(float value) { return hn::Set(Floats(), value); }

/// The series of a Turn: w, x, y, z.
struct Series {
  F c[4][4];
};

/// The series of a step's exponential.
HWY_INLINE Series series_of(F alpha, F beta, F gamma) {
  // The square of the angle is p g² + r g⁴. The cosine, and the sine over the angle, are series in that.
  const F p = hn::MulAdd(alpha, alpha, hn::Mul(beta, beta)), r = hn::Mul(gamma, gamma);
  const F pp = hn::Mul(p, p), pr = hn::Mul(p, r), ppp = hn::Mul(pp, p);
  const F fourth = hn::MulAdd(set(-1 / 240.0f), hn::Mul(p, pr), hn::Mul(set(1 / 24.0f), hn::Mul(r, r)));
  const F sine[4] = {set(1), hn::Mul(set(-1 / 6.0f), p), hn::MulAdd(set(1 / 120.0f), pp, hn::Mul(set(-1 / 6.0f), r)),
                     hn::MulAdd(set(-1 / 5040.0f), ppp, hn::Mul(set(1 / 60.0f), pr))};
  Series s{{{hn::Mul(set(-1 / 2.0f), p), hn::MulAdd(set(1 / 24.0f), pp, hn::Mul(set(-1 / 2.0f), r)),
             hn::MulAdd(set(-1 / 720.0f), ppp, hn::Mul(set(1 / 12.0f), pr)),
             hn::MulAdd(set(1 / 40320.0f), hn::Mul(pp, pp), fourth)}}};
  for (int m = 0; m < 4; ++m) {
    s.c[1][m] = hn::Mul(alpha, sine[m]);
    s.c[2][m] = hn::Mul(beta, sine[m]);
    s.c[3][m] = hn::Mul(gamma, sine[m]);
  }
  return s;
}

/// The product of quaternions as far as the series go; `p` is that of the later turn.
HWY_INLINE Series product(const Series& p, const Series& q) {
  Series result;
#pragma GCC unroll 4
  for (int m = 0; m < 4; ++m) {
    F w = hn::Add(p.c[0][m], q.c[0][m]), x = hn::Add(p.c[1][m], q.c[1][m]);
    F y = hn::Add(p.c[2][m], q.c[2][m]), z = hn::Add(p.c[3][m], q.c[3][m]);
#pragma GCC unroll 4
    for (int j = 0; j < m; ++j) {
      const F pw = p.c[0][j], px = p.c[1][j], py = p.c[2][j], pz = p.c[3][j];
      const int k = m - 1 - j;
      w = hn::MulAdd(pw, q.c[0][k], hn::NegMulAdd(pz, q.c[3][k], w));
      x = hn::MulAdd(px, q.c[0][k], hn::MulAdd(pw, q.c[1][k], x));
      x = hn::MulAdd(py, q.c[3][k], hn::NegMulAdd(pz, q.c[2][k], x));
      y = hn::MulAdd(py, q.c[0][k], hn::MulAdd(pw, q.c[2][k], y));
      y = hn::NegMulAdd(px, q.c[3][k], hn::MulAdd(pz, q.c[1][k], y));
      z = hn::MulAdd(pz, q.c[0][k], hn::MulAdd(pw, q.c[3][k], z));
    }
#pragma GCC unroll 4
    for (int j = 0; j <= m; ++j) {
      const F px = p.c[1][j], py = p.c[2][j], qx = q.c[1][m - j], qy = q.c[2][m - j];
      w = hn::NegMulAdd(px, qx, hn::NegMulAdd(py, qy, w));
      z = hn::MulAdd(px, qy, hn::NegMulAdd(py, qx, z));
    }
    result.c[0][m] = w;
    result.c[1][m] = x;
    result.c[2][m] = y;
    result.c[3][m] = z;
  }
  return result;
}

/// Adds a step to each turn. Of those that would be too great, the turn is `closed`, with `closes` 1, and the step
/// begins the next one. @return whether there are any.
bool add_steps(const float* length, const float (&a)[2][ray_lanes], const float (&b)[2][ray_lanes], float greatest,
               OpenTurns& open, OpenTurns& closed, float* closes) {
  const Floats d;
  bool any = false;
  for (int at = 0; at < ray_lanes; at += static_cast<int>(hn::Lanes(d))) {
    const auto load = [&](const float* from) HWY_ATTR { return hn::LoadU(d, from + at); };
    const F h = load(length), half = hn::Mul(set(0.5f), h), most = set(most_angle), one = set(1);
    const F a1 = load(a[0]), b1 = load(b[0]), a2 = load(a[1]), b2 = load(b[1]);
    F alpha = hn::Mul(half, hn::Add(a1, a2)), beta = hn::Mul(half, hn::Add(b1, b2));
    F gamma =
        hn::Mul(hn::Mul(set(static_cast<float>(gauss_point)), hn::Mul(h, h)), hn::MulSub(a2, b1, hn::Mul(a1, b2)));
    const F z = hn::Mul(set(greatest), gamma);
    const F angle = hn::Mul(set(greatest), hn::Sqrt(hn::MulAdd(z, z, hn::MulAdd(alpha, alpha, hn::Mul(beta, beta)))));
    F part = one, squares = hn::Zero(d);
    for (int n = 0; n < most_squares && !hn::AllFalse(d, hn::Gt(hn::Mul(part, angle), most)); ++n) {
      const auto halves = hn::Gt(hn::Mul(part, angle), most);
      part = hn::IfThenElse(halves, hn::Mul(part, set(0.5f)), part);
      squares = hn::Add(squares, hn::IfThenElseZero(halves, one));
    }
    Series next = series_of(hn::Mul(part, alpha), hn::Mul(part, beta), hn::Mul(part, gamma));
    const F sum = hn::Add(load(open.angle), angle);
    const auto closing = hn::Gt(sum, most);
    hn::StoreU(hn::IfThenElseZero(closing, one), d, closes + at);
    Series before;
    for (int c = 0; c < 4; ++c)
      for (int m = 0; m < 4; ++m) before.c[c][m] = load(open.series[c][m]);
    if (!hn::AllFalse(d, closing)) {
      any = true;
      for (int c = 0; c < 4; ++c)
        for (int m = 0; m < 4; ++m) hn::StoreU(before.c[c][m], d, closed.series[c][m] + at);
      hn::StoreU(load(open.angle), d, closed.angle + at);
      hn::StoreU(load(open.squares), d, closed.squares + at);
    }
    if (!hn::AllTrue(d, closing)) {
      const Series both = product(next, before);
      for (int c = 0; c < 4; ++c)
        for (int m = 0; m < 4; ++m) next.c[c][m] = hn::IfThenElse(closing, next.c[c][m], both.c[c][m]);
    }
    for (int c = 0; c < 4; ++c)
      for (int m = 0; m < 4; ++m) hn::StoreU(next.c[c][m], d, open.series[c][m] + at);
    hn::StoreU(hn::IfThenElse(closing, angle, sum), d, open.angle + at);
    hn::StoreU(squares, d, open.squares + at);
  }
  return any;
}

HWY_INLINE F power_series(const float (&c)[4], F G) {
  return hn::MulAdd(G, hn::MulAdd(G, hn::MulAdd(G, set(c[3]), set(c[2])), set(c[1])), set(c[0]));
}

/// q becomes the product of a turn's quaternion and q.
HWY_INLINE void take(const Turn& turn, F g, F (&q)[4]) {
  const F G = hn::Mul(g, g), two = set(2);
  F v = hn::Neg(hn::Mul(G, power_series(turn.w, G)));  // 1 − w: of small angles, w has few digits.
  F x = hn::Mul(g, power_series(turn.x, G)), y = hn::Mul(g, power_series(turn.y, G));
  F z = hn::Mul(G, power_series(turn.z, G));
  for (int i = 0; i < turn.squares; ++i) {
    const F twice = hn::NegMulAdd(two, v, two);
    x = hn::Mul(twice, x);
    y = hn::Mul(twice, y);
    z = hn::Mul(twice, z);
    v = hn::Mul(hn::Add(v, v), hn::Sub(two, v));
  }
  const F w = hn::Sub(set(1), v);
  const F w0 = q[0], x0 = q[1], y0 = q[2], z0 = q[3];
  q[0] = hn::NegMulAdd(z, z0, hn::NegMulAdd(y, y0, hn::NegMulAdd(x, x0, hn::Mul(w, w0))));
  q[1] = hn::NegMulAdd(z, y0, hn::MulAdd(y, z0, hn::MulAdd(x, w0, hn::Mul(w, x0))));
  q[2] = hn::MulAdd(z, x0, hn::MulAdd(y, w0, hn::NegMulAdd(x, z0, hn::Mul(w, y0))));
  q[3] = hn::MulAdd(z, w0, hn::NegMulAdd(y, x0, hn::MulAdd(x, y0, hn::Mul(w, z0))));
}

void take_turns(const Turn* turns, std::size_t count, const float* strengths, std::size_t room, float* planes) {
  const Floats d;
  for (std::size_t at = 0; at < room; at += hn::Lanes(d)) {
    const F g = hn::LoadU(d, strengths + at);
    F q[4] = {set(1), hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for (std::size_t i = 0; i < count; ++i) take(turns[i], g, q);
    F square = hn::Mul(q[0], q[0]);
    for (int c = 1; c < 4; ++c) square = hn::MulAdd(q[c], q[c], square);
    const F scale = hn::Div(set(1), hn::Sqrt(square));
    for (std::size_t c = 0; c < 4; ++c) hn::StoreU(hn::Mul(q[c], scale), d, planes + c * room + at);
  }
}

void add_all(const float* planes, float weight, std::size_t room, float* rotations) {
  const Floats d;
  for (std::size_t at = 0; at < room; at += hn::Lanes(d)) {
    F q[4];
    for (std::size_t c = 0; c < 4; ++c) q[c] = hn::LoadU(d, planes + c * room + at);
    const F twice = set(2 * weight), one = set(weight);
    const F w = hn::Mul(q[0], twice), x = hn::Mul(q[1], twice), y = hn::Mul(q[2], twice), z = hn::Mul(q[3], twice);
    const F xx = hn::Mul(x, q[1]), yy = hn::Mul(y, q[2]), zz = hn::Mul(z, q[3]);
    const F xy = hn::Mul(x, q[2]), xz = hn::Mul(x, q[3]), yz = hn::Mul(y, q[3]);
    const F wx = hn::Mul(w, q[1]), wy = hn::Mul(w, q[2]), wz = hn::Mul(w, q[3]);
    const F entries[9] = {hn::Sub(one, hn::Add(yy, zz)), hn::Sub(xy, wz), hn::Add(xz, wy), hn::Add(xy, wz),
                          hn::Sub(one, hn::Add(xx, zz)), hn::Sub(yz, wx), hn::Sub(xz, wy), hn::Add(yz, wx),
                          hn::Sub(one, hn::Add(xx, yy))};
    for (std::size_t i = 0; i < 9; ++i) {
      float* const to = rotations + i * room + at;
      hn::StoreU(hn::Add(hn::LoadU(d, to), entries[i]), d, to);
    }
  }
}

void sum_all(const float* rotations, std::size_t planes, const float* colors, std::size_t room, float* sums) {
  const Floats d;
  for (std::size_t plane = 0; plane < planes; ++plane)
    for (std::size_t c = 0; c < 3; ++c) {
      F sum = hn::Zero(d);
      for (std::size_t at = 0; at < room; at += hn::Lanes(d))
        sum = hn::MulAdd(hn::LoadU(d, rotations + plane * room + at), hn::LoadU(d, colors + c * room + at), sum);
      sums[3 * plane + c] = hn::GetLane(hn::SumOfLanes(d, sum));
    }
}

}  // namespace
}  // namespace tensorray::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

HWY_EXPORT(add_steps);
HWY_EXPORT(take_turns);
HWY_EXPORT(add_all);
HWY_EXPORT(sum_all);

void RayTurns::restart() {
  open_ = {};
  for (std::vector<Turn>& each : turns) each.clear();
}

void RayTurns::close(const OpenTurns& which, std::size_t ray) {
  if (which.angle[ray] == 0) return;
  Turn& turn = turns[ray].emplace_back();
  for (int m = 0; m < 4; ++m) {
    turn.w[m] = which.series[0][m][ray];
    turn.x[m] = which.series[1][m][ray];
    turn.y[m] = which.series[2][m][ray];
    turn.z[m] = which.series[3][m][ray];
  }
  turn.squares = static_cast<int>(which.squares[ray]);
}

void RayTurns::add(const float (&length)[ray_lanes], const float (&a)[2][ray_lanes], const float (&b)[2][ray_lanes]) {
  OpenTurns closed;
  float closes[ray_lanes];
  if (!HWY_DYNAMIC_DISPATCH(add_steps)(length, a, b, static_cast<float>(greatest), open_, closed, closes)) return;
  for (std::size_t ray = 0; ray < ray_lanes; ++ray)
    if (closes[ray] > 0) close(closed, ray);
}

void RayTurns::finish() {
  for (std::size_t ray = 0; ray < ray_lanes; ++ray) close(open_, ray);
}

void turn(const std::vector<Turn>& turns, const float* strengths, std::size_t room, float* planes) {
  HWY_DYNAMIC_DISPATCH(take_turns)(turns.data(), turns.size(), strengths, room, planes);
}

void add_rotations(const float* planes, float weight, std::size_t room, float* rotations) {
  HWY_DYNAMIC_DISPATCH(add_all)(planes, weight, room, rotations);
}

void sum_colors(const float* rotations, std::size_t planes, const float* colors, std::size_t room, float* sums) {
  HWY_DYNAMIC_DISPATCH(sum_all)(rotations, planes, colors, room, sums);
}

}  // namespace tensorray
#endif
