/// @file integrators/packet_bending-inl.h
/// The kick of a step: exp(s h T) V, normalised. A part of packet_kernel.cpp.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_BENDING_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_BENDING_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_BENDING_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_BENDING_TOGGLE
#endif

#include <hwy/highway.h>

#include "integrators/packet_cells-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

/// 1 / √(1 + excess) for an excess below 0.006, to 7e-8: less than rounding, and corrected in the next step.
HWY_INLINE F inverse_root_near_one(F excess) {
  return hn::MulAdd(hn::MulAdd(set(3.0f / 8), excess, set(-0.5f)), excess, set(1));
}

/// |v|² − 1.
HWY_INLINE F excess(const F3& v) { return hn::MulAdd(v.x, v.x, hn::MulAdd(v.y, v.y, hn::MulAdd(v.z, v.z, set(-1)))); }

/// Two terms of exp(factor · T) v.
HWY_INLINE F3 two_terms(const Tensor& T, const F3& v, const F3& inner, F factor) {
  const F3 half = mul_add(hn::Mul(set(0.5f), factor), apply(T, inner), v);
  return mul_add(factor, apply(T, half), v);
}

/// exp(factor · T) V, normalised, where ‖factor · T‖ is small in all lanes: two terms, and the square root as a series.
HWY_INLINE F3 bend_weakly(const Tensor& T, const F3& v, F factor) {
  const F3 sum = two_terms(T, v, v, factor);
  return mul(inverse_root_near_one(excess(sum)), sum);
}

/// The Frobenius norm of the deviator of factor · T. T itself may be too large, or too small, for its square.
HWY_INLINE F deviator_norm(const Tensor& T, F factor) {
  F squares = hn::Zero(floats);
  for (int i = 0; i < 8; ++i) {
    const F scaled = hn::Mul(factor, T.c[i]);
    squares = hn::MulAdd(scaled, scaled, squares);
  }
  const F trace = hn::Mul(factor, hn::Add(T.c[0], T.c[4]));
  const F deviator = hn::Max(hn::NegMulAdd(hn::Mul(trace, trace), set(1.0f / 3), squares), hn::Zero(floats));
  return hn::Sqrt(hn::IfThenElse(hn::Le(squares, set(1e38f)), deviator, squares));  // Infinity stays what it is.
}

/// Keeps s times the norm of T's deviator, where steps may have to be shorter for it.
HWY_INLINE void keep_bending_rate(Packet& packet, const Tensor& T, int at) {
  if (packet.greatest_reach <= strongest_kick) return;
  store(deviator_norm(T, load(packet.kick, at)), packet.bending_rate, at);
}

/// Lanes where ‖factor · T‖ is too large for a series, given as bits.
HWY_NOINLINE F3 bend_in_double(const Tensor& T, const F3& v, F factor, const F3& others, std::uint32_t which) {
  alignas(64) float all[8][lanes], factors[lanes], from[3][lanes], to[3][lanes];
  for (int i = 0; i < 8; ++i) hn::Store(T.c[i], floats, all[i]);
  hn::Store(factor, floats, factors);
  const auto keep = [&](const F3& a, float(&b)[3][lanes]) HWY_ATTR {
    hn::Store(a.x, floats, b[0]);
    hn::Store(a.y, floats, b[1]);
    hn::Store(a.z, floats, b[2]);
  };
  keep(v, from);
  keep(others, to);
  for (int lane = 0; lane < lanes; ++lane) {
    if (!(which >> lane & 1)) continue;
    float one[8], direction[3] = {from[0][lane], from[1][lane], from[2][lane]};
    for (int i = 0; i < 8; ++i) one[i] = all[i][lane];
    Medium::exponential(one, factors[lane], direction);
    for (int axis = 0; axis < 3; ++axis) to[axis][lane] = direction[axis];
  }
  return {hn::Load(floats, to[0]), hn::Load(floats, to[1]), hn::Load(floats, to[2])};
}

/// The same for any strength. Which lane is computed how depends on that lane alone.
template <bool differentials>
HWY_INLINE F3 bend_strongly(Packet& packet, const Tensor& T, const F3& v, F factor, int at) {
  const F reach = load(packet.reach, at);
  F size = reach;
  if (HWY_UNLIKELY(!(packet.greatest_reach <= strongest_kick))) {
    const F norm = deviator_norm(T, factor), time = hn::Max(load(packet.time, at), set(1e-30f));
    store(hn::Div(norm, time), packet.bending_rate, at);
    size = hn::IfThenElse(hn::Le(reach, set(strongest_kick)), reach, norm);
  }
  if constexpr (differentials) store(size, packet.size, at);
  int terms = 2;
  while (terms < most_terms && !hn::AllTrue(floats, hn::Le(size, set(series_reach[terms - 2])))) ++terms;
  F3 inner = v;  // Horner's rule, from the last term that any lane needs.
  for (int n = terms; n > 2; --n) {
    const F part = hn::Mul(set(1.0f / static_cast<float>(n)), factor);
    inner = select(hn::Gt(size, set(series_reach[n - 3])), mul_add(part, apply(T, inner), v), v);
  }
  const F3 sum = two_terms(T, v, inner, factor);
  const F e = excess(sum);
  const F exact = hn::Div(set(1), hn::Sqrt(hn::Add(e, set(1))));
  const Mask weak = hn::Le(size, set(series_reach[0]));
  const F3 result = mul(hn::IfThenElse(weak, inverse_root_near_one(e), exact), sum);

  const Mask fits = hn::Le(size, set(1));
  if (HWY_LIKELY(hn::AllTrue(floats, fits))) return result;
  if constexpr (differentials) return select(fits, result, zeros());  // Those rays stop here.
  return bend_in_double(T, v, factor, result, to_bits(hn::Not(fits), 0));
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
