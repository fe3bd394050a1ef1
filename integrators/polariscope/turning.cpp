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

constexpr double small_angle = 0.35;  // The series of `turned` leave 1e-7 of it.
constexpr double left_out = 1e-6;     // Of turns that are joined, at most.

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, ray_lanes>;
using F = hn::Vec<Floats>;

HWY_INLINE F set(double value) { return hn::Set(Floats(), static_cast<float>(value)); }
HWY_INLINE F load(const float* from) { return hn::LoadU(Floats(), from); }
HWY_INLINE void store(F value, float* to) { hn::StoreU(value, Floats(), to); }

/// w + xi + yj + zk: a unitary matrix, but for its length; or angles β, γ and α, with w = 0.
struct Quaternion {
  F w, x, y, z;
};

HWY_INLINE Quaternion scaled(F scale, const Quaternion& q) {
  return {scale * q.w, scale * q.x, scale * q.y, scale * q.z};
}

HWY_INLINE F length(const Quaternion& q) { return hn::Sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z); }

HWY_INLINE Quaternion unit(const Quaternion& q) { return scaled(set(1) / length(q), q); }

/// The product with a quaternion whose real part is 0, and `sum`.
HWY_INLINE Quaternion add_product(const Quaternion& v, const Quaternion& q, const Quaternion& sum) {
  const auto add = [](F a, F b, F c, F d, F minus_e, F f, F to)
                       HWY_ATTR { return hn::MulAdd(a, b, hn::MulAdd(c, d, hn::NegMulAdd(minus_e, f, to))); };
  return {hn::NegMulAdd(v.x, q.x, hn::NegMulAdd(v.y, q.y, hn::NegMulAdd(v.z, q.z, sum.w))),
          add(v.x, q.w, v.y, q.z, v.z, q.y, sum.x), add(v.y, q.w, v.z, q.x, v.x, q.z, sum.y),
          add(v.z, q.w, v.x, q.y, v.y, q.x, sum.z)};
}

void join_turns(const RaySteps& steps, RayTurns& turns) {
  const Floats d;
  const hn::RebindToSigned<Floats> ints;
  const F zero = hn::Zero(d);
  for (int at = 0; at < ray_lanes; at += static_cast<int>(hn::Lanes(d))) {
    const F h = load(steps.length + at);  // Times a and b first: alone, its square may be beyond single precision.
    const F a1 = h * load(steps.a[0] + at), b1 = h * load(steps.b[0] + at);
    const F a2 = h * load(steps.a[1] + at), b2 = h * load(steps.b[1] + at);
    store(set(0.5) * (hn::Sqrt(a1 * a1 + b1 * b1) + hn::Sqrt(a2 * a2 + b2 * b2)), turns.phase + at);
    Quaternion step{zero, set(0.5) * (b1 + b2), set(gauss_point) * (a2 * b1 - a1 * b2), set(0.5) * (a1 + a2)};
    auto squares = hn::Zero(ints);
    for (int n = 0; n < 120; ++n) {
      const auto is_large = hn::Gt(length(step), set(small_angle));
      if (hn::AllFalse(d, is_large)) break;
      step = scaled(hn::IfThenElse(is_large, set(0.5), set(1)), step);
      squares = hn::Sub(squares, hn::VecFromMask(ints, hn::RebindMask(ints, is_large)));
    }
    const Quaternion last{zero, load(turns.beta + at), load(turns.gamma + at), load(turns.alpha + at)};
    Quaternion turn = add_product(step, last, {zero, zero, zero, zero});
    turn.w = zero;
    const Quaternion sum{zero, step.x + last.x, step.y + last.y + turn.y, step.z + last.z};
    // Left out are the parts of `turn` that have g³, and the products with it that come next: a third at most.
    const F left = hn::Abs(turn.x) + hn::Abs(turn.z) + set(1 / 3.0) * length(turn) * (length(step) + length(last));
    const auto whole = hn::Eq(hn::Or(squares, hn::LoadU(ints, turns.squares + at)), hn::Zero(ints));
    const auto small = hn::And(hn::Lt(left, set(left_out)), hn::Lt(length(sum), set(small_angle)));
    const auto joined = hn::And(hn::RebindMask(d, whole), small);
    store(hn::IfThenElse(joined, sum.z, step.z), turns.alpha + at);
    store(hn::IfThenElse(joined, sum.x, step.x), turns.beta + at);
    store(hn::IfThenElse(joined, sum.y, step.y), turns.gamma + at);
    hn::StoreU(squares, ints, turns.squares + at);
    hn::StoreU(hn::VecFromMask(ints, hn::RebindMask(ints, joined)), ints, turns.joined + at);
  }
}

/// The product of a step's quaternion and that of the light before it.
HWY_INLINE Quaternion turned(const Turn& turn, F g, const Quaternion& before) {
  const F one = set(1), alpha = set(turn.alpha), beta = set(turn.beta), gamma = g * set(turn.gamma);
  // The square of the angle, and the tangent over the angle, as far as it matters.
  const F t = g * g * hn::MulAdd(gamma, gamma, set(turn.alpha * turn.alpha + turn.beta * turn.beta));
  const F high = hn::MulAdd(t, hn::MulAdd(t, set(62 / 2835.0), set(17 / 315.0)), set(2 / 15.0));
  const F tangent = g * hn::MulAdd(t, hn::MulAdd(t, high, set(1 / 3.0)), one);
  Quaternion q{one, alpha * tangent, beta * tangent, gamma * tangent};
  if (turn.squares == 0) return add_product(q, before, before);
  for (int n = 0; n < turn.squares; ++n) {
    const F cosine = q.w * q.w, sine = q.x * q.x + q.y * q.y + q.z * q.z, twice = set(2) * q.w;
    q = scaled(one / (cosine + sine), {cosine - sine, twice * q.x, twice * q.y, twice * q.z});
  }
  return add_product(q, before, scaled(q.w, before));
}

void take_turns(const Turn* turns, std::size_t count, const float* strengths, std::size_t room, float weight,
                float* quaternions, float* light) {
  for (std::size_t at = 0; at < room; at += hn::Lanes(Floats())) {
    const F g = load(strengths + at);
    Quaternion q{set(1), set(0), set(0), set(0)};
    for (std::size_t i = 0; i < count; ++i) {
      q = turned(turns[i], g, q);
      if (i % 64 == 63) q = unit(q);  // Before it is too long.
    }
    const auto [w, x, y, z] = unit(q);
    const F quaternion[4] = {w, x, y, z};
    for (std::size_t c = 0; c < 4; ++c) store(quaternion[c], quaternions + c * room + at);
    const F one = set(weight), t = set(2 * weight);
    const F more[10] = {one - t * (y * y + z * z), t * (x * y - w * z),
                        t * (x * z + w * y),       t * (x * y + w * z),
                        one - t * (x * x + z * z), t * (y * z - w * x),
                        t * (x * z - w * y),       t * (y * z + w * x),
                        one - t * (x * x + y * y), one};
    for (std::size_t i = 0; i < 10; ++i) store(load(light + i * room + at) + more[i], light + i * room + at);
  }
}

}  // namespace
}  // namespace tensorray::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

HWY_EXPORT(join_turns);
HWY_EXPORT(take_turns);

void add_turns(const RaySteps& steps, RayTurns& turns) { HWY_DYNAMIC_DISPATCH(join_turns)(steps, turns); }

void turn(const std::vector<Turn>& turns, const float* strengths, std::size_t room, float weight, float* quaternions,
          float* light) {
  HWY_DYNAMIC_DISPATCH(take_turns)(turns.data(), turns.size(), strengths, room, weight, quaternions, light);
}

}  // namespace tensorray
#endif
