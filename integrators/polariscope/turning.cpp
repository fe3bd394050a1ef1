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

void find_turns(const RaySteps& steps, RayTurns& turns) {
  const Floats d;
  const hn::RebindToSigned<Floats> ints;
  for (int at = 0; at < ray_lanes; at += static_cast<int>(hn::Lanes(d))) {
    const F h = load(steps.length + at);  // Times a and b first: alone, its square may be beyond single precision.
    const F a1 = h * load(steps.a[0] + at), b1 = h * load(steps.b[0] + at);
    const F a2 = h * load(steps.a[1] + at), b2 = h * load(steps.b[1] + at);
    const F alpha = set(0.5) * (a1 + a2), beta = set(0.5) * (b1 + b2), gamma = set(gauss_point) * (a2 * b1 - a1 * b2);
    const F angle = hn::Sqrt(alpha * alpha + beta * beta + gamma * gamma);
    F part = set(1);
    auto squares = hn::Zero(ints);
    for (int n = 0; n < 120; ++n) {
      const auto is_large = hn::Gt(part * angle, set(0.75));  // 0.75⁹ / 9! is 2e-7: what the series below cut.
      if (hn::AllFalse(d, is_large)) break;
      part = hn::IfThenElse(is_large, part * set(0.5), part);
      squares = hn::Sub(squares, hn::VecFromMask(ints, hn::RebindMask(ints, is_large)));
    }
    store(part * alpha, turns.alpha + at);
    store(part * beta, turns.beta + at);
    store(part * gamma, turns.gamma + at);
    hn::StoreU(squares, ints, turns.squares + at);
    store(set(0.5) * (hn::Sqrt(a1 * a1 + b1 * b1) + hn::Sqrt(a2 * a2 + b2 * b2)), turns.phase + at);
  }
}

/// A unitary matrix, but for its length, as a quaternion.
struct Quaternion {
  F w, x, y, z;
};

HWY_INLINE Quaternion operator*(const Quaternion& p, const Quaternion& q) {
  const auto sum = [](F a, F b, F c, F d, F e, F f, F g, F h)
                       HWY_ATTR { return hn::MulAdd(a, b, hn::MulAdd(c, d, hn::NegMulAdd(g, h, e * f))); };
  return {hn::NegMulAdd(p.x, q.x, hn::NegMulAdd(p.y, q.y, hn::NegMulAdd(p.z, q.z, p.w * q.w))),
          sum(p.w, q.x, p.x, q.w, p.y, q.z, p.z, q.y), sum(p.w, q.y, p.y, q.w, p.z, q.x, p.x, q.z),
          sum(p.w, q.z, p.z, q.w, p.x, q.y, p.y, q.x)};
}

HWY_INLINE Quaternion quaternion_of(const RayTurns& turns, std::size_t ray, F g) {
  const F alpha = set(turns.alpha[ray]), beta = set(turns.beta[ray]), gamma = g * set(turns.gamma[ray]);
  const F x = g * g * (alpha * alpha + beta * beta + gamma * gamma);  // The square of the angle.
  const F sine = g * (set(1) + x * (set(-1 / 6.0) + x * (set(1 / 120.0) + x * set(-1 / 5040.0))));
  // With w − 1 for w, which has few digits of small angles.
  Quaternion q{x * (set(-0.5) + x * (set(1 / 24.0) + x * (set(-1 / 720.0) + x * set(1 / 40320.0)))), alpha * sine,
               beta * sine, gamma * sine};
  for (int n = 0; n < turns.squares[ray]; ++n) {
    const F twice = set(2) * q.w + set(2), squares = q.x * q.x + q.y * q.y + q.z * q.z;
    // Beyond a quarter turn, 1 + w has few digits.
    q = {hn::IfThenElse(hn::Lt(q.w, set(-1)), set(-2) * squares, q.w * (twice + set(2))), twice * q.x, twice * q.y,
         twice * q.z};
  }
  q.w = q.w + set(1);
  return q;
}

void take_turns(const RayTurns* turns, std::size_t count, std::size_t ray, const float* strengths, std::size_t room,
                float weight, float* quaternions, float* light) {
  for (std::size_t at = 0; at < room; at += hn::Lanes(Floats())) {
    Quaternion q{set(1), set(0), set(0), set(0)};
    for (std::size_t i = 0; i < count; ++i) q = quaternion_of(turns[i], ray, load(strengths + at)) * q;
    const F scale = set(1) / hn::Sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    const F w = scale * q.w, x = scale * q.x, y = scale * q.y, z = scale * q.z;
    const F unit[4] = {w, x, y, z};
    for (std::size_t c = 0; c < 4; ++c) store(unit[c], quaternions + c * room + at);
    const F one = set(weight), t = set(2 * weight);
    const F more[10] = {one - t * (y * y + z * z),
                        t * (x * y - w * z),
                        t * (x * z + w * y),  //
                        t * (x * y + w * z),
                        one - t * (x * x + z * z),
                        t * (y * z - w * x),  //
                        t * (x * z - w * y),
                        t * (y * z + w * x),
                        one - t * (x * x + y * y),  //
                        one};
    for (std::size_t i = 0; i < 10; ++i) store(load(light + i * room + at) + more[i], light + i * room + at);
  }
}

}  // namespace
}  // namespace tensorray::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

HWY_EXPORT(find_turns);
HWY_EXPORT(take_turns);

RayTurns turns_of(const RaySteps& steps) {
  RayTurns turns;
  HWY_DYNAMIC_DISPATCH(find_turns)(steps, turns);
  return turns;
}

void turn(const std::vector<RayTurns>& turns, std::size_t ray, const float* strengths, std::size_t room, float weight,
          float* quaternions, float* light) {
  HWY_DYNAMIC_DISPATCH(take_turns)(turns.data(), turns.size(), ray, strengths, room, weight, quaternions, light);
}

}  // namespace tensorray
#endif
