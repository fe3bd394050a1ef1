#include "integrators/polariscope/turning.h"

#include <algorithm>
#include <cmath>

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
using Floats = hn::CappedTag<float, 16>;
using F = hn::Vec<Floats>;

HWY_INLINE F series(F s, const float (&coefficients)[5]) {
  const Floats d;
  F sum = hn::Set(d, coefficients[4]);
  for (int i = 3; i >= 0; --i) sum = hn::MulAdd(sum, s, hn::Set(d, coefficients[i]));
  return hn::MulAdd(sum, s, hn::Set(d, 1));
}

/// q becomes the product of a step's quaternion and q.
HWY_INLINE void take(const TurningStep& step, F g, F (&q)[4]) {
  const Floats d;
  constexpr float cosine[] = {-1 / 2.0f, 1 / 24.0f, -1 / 720.0f, 1 / 40320.0f, -1 / 3628800.0f};
  constexpr float sine[] = {-1 / 6.0f, 1 / 120.0f, -1 / 5040.0f, 1 / 362880.0f, -1 / 39916800.0f};
  F x = hn::Mul(g, hn::Set(d, step.alpha)), y = hn::Mul(g, hn::Set(d, step.beta));
  F z = hn::Mul(hn::Mul(g, g), hn::Set(d, step.gamma));
  const F s = hn::MulAdd(z, z, hn::MulAdd(y, y, hn::Mul(x, x)));
  F c = series(s, cosine), f = series(s, sine);
  for (int i = 0; i < step.halvings; ++i) {
    f = hn::Mul(f, hn::Add(c, c));
    c = hn::Sub(hn::Mul(hn::Add(c, c), c), hn::Set(d, 1));
  }
  x = hn::Mul(x, f);
  y = hn::Mul(y, f);
  z = hn::Mul(z, f);
  const F w0 = q[0], x0 = q[1], y0 = q[2], z0 = q[3];
  q[0] = hn::NegMulAdd(z, z0, hn::NegMulAdd(y, y0, hn::NegMulAdd(x, x0, hn::Mul(c, w0))));
  q[1] = hn::NegMulAdd(z, y0, hn::MulAdd(y, z0, hn::MulAdd(x, w0, hn::Mul(c, x0))));
  q[2] = hn::MulAdd(z, x0, hn::MulAdd(y, w0, hn::NegMulAdd(x, z0, hn::Mul(c, y0))));
  q[3] = hn::MulAdd(z, w0, hn::NegMulAdd(y, x0, hn::MulAdd(x, y0, hn::Mul(c, z0))));
}

void turn_all(const TurningStep* steps, std::size_t count, const float* strengths, std::size_t room, float* planes) {
  const Floats d;
  for (std::size_t at = 0; at < room; at += hn::Lanes(d)) {
    const F g = hn::LoadU(d, strengths + at);
    F q[4] = {hn::Set(d, 1), hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for (std::size_t i = 0; i < count; ++i) take(steps[i], g, q);
    F square = hn::Mul(q[0], q[0]);
    for (int c = 1; c < 4; ++c) square = hn::MulAdd(q[c], q[c], square);
    const F scale = hn::Div(hn::Set(d, 1), hn::Sqrt(square));
    for (std::size_t c = 0; c < 4; ++c) hn::StoreU(hn::Mul(q[c], scale), d, planes + c * room + at);
  }
}

void add_all(const float* planes, float weight, std::size_t room, float* rotations) {
  const Floats d;
  for (std::size_t at = 0; at < room; at += hn::Lanes(d)) {
    F q[4];
    for (std::size_t c = 0; c < 4; ++c) q[c] = hn::LoadU(d, planes + c * room + at);
    const F twice = hn::Set(d, 2 * weight);
    const F w = hn::Mul(q[0], twice), x = hn::Mul(q[1], twice), y = hn::Mul(q[2], twice), z = hn::Mul(q[3], twice);
    const F one = hn::Set(d, weight), xx = hn::Mul(x, q[1]), yy = hn::Mul(y, q[2]), zz = hn::Mul(z, q[3]);
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

}  // namespace
}  // namespace tensorray::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

constexpr int most_halvings = 60;

HWY_EXPORT(turn_all);
HWY_EXPORT(add_all);

void TurningSteps::add(double h, double a1, double b1, double a2, double b2) {
  const double alpha = h * (a1 + a2) / 2, beta = h * (b1 + b2) / 2, gamma = gauss_point * h * h * (a2 * b1 - a1 * b2);
  const double length = greatest * std::sqrt(alpha * alpha + beta * beta + std::pow(greatest * gamma, 2));
  if (!(length > 0)) return;
  const int halvings = length > 1 ? std::ilogb(std::min(length, std::ldexp(1.0, most_halvings - 1))) + 1 : 0;
  const double part = halvings > 0 ? std::ldexp(1.0, -halvings) : 1;
  steps.push_back(
      {static_cast<float>(part * alpha), static_cast<float>(part * beta), static_cast<float>(part * gamma), halvings});
}

void turn(const TurningSteps& steps, const float* strengths, std::size_t room, float* planes) {
  HWY_DYNAMIC_DISPATCH(turn_all)(steps.steps.data(), steps.steps.size(), strengths, room, planes);
}

void add_rotations(const float* planes, float weight, std::size_t room, float* rotations) {
  HWY_DYNAMIC_DISPATCH(add_all)(planes, weight, room, rotations);
}

}  // namespace tensorray
#endif
