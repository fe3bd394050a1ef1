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

/// exp(factor · T) V, normalised, where ‖factor · T‖ is small in all lanes: two terms, and the square root as a series.
HWY_INLINE F3 bend_weakly(const Tensor& T, const F3& v, F factor) {
  const F3 first = mul(factor, apply(T, v));
  const F3 second = apply(T, first);
  const F3 sum = mul_add(hn::Mul(set(0.5f), factor), second, add(v, first));
  const F e = hn::Sub(dot(sum, sum), set(1));
  const F series = hn::MulAdd(hn::MulAdd(set(-5.0f / 16), e, set(3.0f / 8)), e, set(-0.5f));
  return mul(hn::MulAdd(series, e, set(1)), sum);
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

/// The same for any strength. Which lane is computed how depends on that lane alone.
template <bool differentials>
HWY_INLINE F3 bend_strongly(Packet& packet, const Tensor& T, const F3& v, F factor) {
  const F reach = hn::Load(floats, packet.reach);
  F size = reach;
  if (HWY_UNLIKELY(!(packet.greatest_reach <= strongest_kick))) {
    const F norm = deviator_norm(T, factor), time = hn::Max(hn::Load(floats, packet.time), set(1e-30f));
    hn::Store(hn::Div(norm, time), floats, packet.bending_rate);
    size = hn::IfThenElse(hn::Le(reach, set(strongest_kick)), reach, norm);
  }
  if constexpr (differentials) hn::Store(size, floats, packet.size);
  const F3 first = mul(factor, apply(T, v)), second = apply(T, first);
  const F half = hn::Mul(set(0.5f), factor);
  F3 sum = mul_add(half, second, add(v, first)), term = mul(half, second);
  for (int n = 3; n <= most_terms; ++n) {
    const Mask needed = hn::Gt(size, set(series_reach[n - 3]));
    if (hn::AllFalse(floats, needed)) break;
    term = mul(hn::Mul(set(1.0f / static_cast<float>(n)), factor), apply(T, term));
    const F zero = hn::Zero(floats);
    sum = add(sum, select(needed, term, {zero, zero, zero}));
  }
  const F squared = dot(sum, sum), e = hn::Sub(squared, set(1));
  const F series = hn::MulAdd(hn::MulAdd(set(-5.0f / 16), e, set(3.0f / 8)), e, set(-0.5f));
  const F exact = hn::Div(set(1), hn::Sqrt(squared));
  const Mask weak = hn::Le(size, set(series_reach[0]));
  F3 result = mul(hn::IfThenElse(weak, hn::MulAdd(series, e, set(1)), exact), sum);

  const Mask fits = hn::Le(size, set(1));
  if (HWY_LIKELY(hn::AllTrue(floats, fits))) return result;
  if constexpr (differentials) {  // Those rays stop here.
    const F zero = hn::Zero(floats);
    return select(fits, result, {zero, zero, zero});
  }
  const std::uint32_t too_strong = ~to_bits(fits);
  alignas(64) float all[8][most_lanes], factors[most_lanes], from[3][most_lanes], to[3][most_lanes];
  for (int i = 0; i < 8; ++i) hn::Store(T.c[i], floats, all[i]);
  hn::Store(factor, floats, factors);
  store(v, from);
  store(result, to);
  for (int lane = 0; lane < lanes; ++lane) {
    if (!(too_strong >> lane & 1)) continue;
    float one[8], direction[3] = {from[0][lane], from[1][lane], from[2][lane]};
    for (int i = 0; i < 8; ++i) one[i] = all[i][lane];
    Medium::exponential(one, factors[lane], direction);
    for (int axis = 0; axis < 3; ++axis) to[axis][lane] = direction[axis];
  }
  return load(to);
}

/// The same, whichever it takes.
template <bool differentials>
HWY_INLINE F3 bend(Packet& packet, const Tensor& T, const F3& v, F factor) {
  if (HWY_LIKELY(packet.greatest_reach <= series_reach[0])) {
    if constexpr (differentials) hn::Store(hn::Load(floats, packet.reach), floats, packet.size);
    return bend_weakly(T, v, factor);
  }
  return bend_strongly<differentials>(packet, T, v, factor);
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
