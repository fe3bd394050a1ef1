/// @file integrators/kernels/packet_bending-inl.h
/// The kick of a step: exp(σ h T) V, normalised. A part of packet_kernel-inl.h.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_BENDING_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_BENDING_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_BENDING_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_BENDING_TOGGLE
#endif

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include "integrators/kernels/packet_exponential-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

/// 1 / √(1 + excess) for an excess below 0.006, to 7e-8: this error is below rounding, and the next step corrects it.
HWY_INLINE F inverse_root_near_one(F excess) {
  return hn::MulAdd(hn::MulAdd(set(3.0f / 8), excess, set(-0.5f)), excess, set(1));
}

/// The same for an excess below 0.0475, to 6e-8. That of exp(A) V is, if no two eigenvalues of A differ by more than
/// √2 · series_reach[1].
HWY_INLINE F inverse_root_nearby(F excess) {
  const F inner = hn::MulAdd(hn::MulAdd(set(35.0f / 128), excess, set(-5.0f / 16)), excess, set(3.0f / 8));
  return hn::MulAdd(hn::MulAdd(inner, excess, set(-0.5f)), excess, set(1));
}

/// |v|² − 1.
HWY_INLINE F excess(const F3& v) { return hn::MulAdd(v.x, v.x, hn::MulAdd(v.y, v.y, hn::MulAdd(v.z, v.z, set(-1)))); }

/// exp(factor · T) v by two terms of the series; `inner` holds the further terms.
HWY_INLINE F3 two_terms(const Tensor& T, const F3& v, const F3& inner, F factor) {
  const F3 half = mul_add(hn::Mul(set(0.5f), factor), apply(T, inner), v);
  return mul_add(factor, apply(T, half), v);
}

/// ln(1 + excess) for an excess below 0.006, to 1e-9.
HWY_INLINE F log_near_one(F excess) {
  const F inner = hn::MulAdd(hn::MulAdd(set(-0.25f), excess, set(1.0f / 3)), excess, set(-0.5f));
  return hn::Mul(hn::MulAdd(inner, excess, set(1)), excess);
}

/// Λ of a kick: factor tr T − 3 ln |exp(factor · T) V|. Adding c I to T does not change it. @param log_squared
/// ln |exp(factor · T) V|².
HWY_INLINE F log_radiance_scale(const Tensor& T, F factor, F log_squared) {
  return hn::MulAdd(factor, hn::Add(T.c[0], T.c[4]), hn::Mul(set(-1.5f), log_squared));
}

/// exp(factor · T) V, normalised, where ‖factor · T‖ is small in all lanes: two terms of the series, and the square
/// root as a series. `changes`: stores Λ of the kick.
template <bool changes>
HWY_INLINE F3 bend_weakly(Packet& packet, const Tensor& T, const F3& v, F factor, int at) {
  const F3 sum = two_terms(T, v, v, factor);
  const F e = excess(sum);
  if constexpr (changes) store(log_radiance_scale(T, factor, log_near_one(e)), packet.change_of_step, at);
  return mul(inverse_root_near_one(e), sum);
}

/// The Frobenius norm of the deviator of factor · T. The factor comes first, because T itself may be too large, or too
/// small, for its square.
HWY_INLINE F deviator_norm(const Tensor& T, F factor) {
  F squares = hn::Zero(floats);
  for (int i = 0; i < 8; ++i) {
    const F scaled = hn::Mul(factor, T.c[i]);
    squares = hn::MulAdd(scaled, scaled, squares);
  }
  const F trace = hn::Mul(factor, hn::Add(T.c[0], T.c[4]));
  const F deviator = hn::Max(hn::NegMulAdd(hn::Mul(trace, trace), set(1.0f / 3), squares), hn::Zero(floats));
  return hn::Sqrt(hn::IfThenElse(hn::Le(squares, set(1e38f)), deviator, squares));  // Infinity stays infinite.
}

/// Stores |kick| times the norm of T's deviator where it may make steps shorter.
HWY_INLINE void keep_bending_rate(const PacketMedium& medium, Packet& packet, const Tensor& T, int at) {
  if (packet.greatest_reach <= strongest_kick) return;
  const F unit = set(medium.unit);
  store(hn::Div(deviator_norm(T, hn::Mul(unit, load(packet.kick, at))), unit), packet.bending_rate, at);
}

/// exp(factor · T) V, normalised, for any strength. The result is stored: a returned value would pass through memory in
/// halves of vectors, which stalls the processor. How a lane is computed depends on that lane alone.
/// @param from  The directions, of which `v` are those at `at`.
/// @param part  The part of the step that this kick takes.
/// @param to  The packet's next directions; its present ones only if the field is weak in all lanes' bricks.
/// `changes`: stores Λ of the kick.
template <int components, bool differentials, bool changes>
HWY_INLINE void bend_strongly(Packet& packet, const Tensor& T, const PerRay (&from)[3], const F3& v, float part,
                              F factor, int at, PerRay (&to)[3]) {
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
    const F nth = hn::Mul(set(1.0f / static_cast<float>(n)), factor);
    inner = select(hn::Gt(size, set(series_reach[n - 3])), mul_add(nth, apply(T, inner), v), v);
  }
  const F3 sum = two_terms(T, v, inner, factor);
  const F e = excess(sum);
  const Mask weak = hn::Le(size, set(series_reach[0])), fits = hn::Le(size, set(1));
  F scale = inverse_root_near_one(e);
  if (terms > 2) scale = hn::IfThenElse(weak, scale, inverse_root_nearby(e));
  if (terms > 3) {
    const F root = hn::Div(set(1), hn::Sqrt(hn::Add(e, set(1))));
    scale = hn::IfThenElse(hn::Le(size, set(series_reach[1])), scale, root);
  }
  if constexpr (changes) {
    F log_squared = log_near_one(e);
    if (!hn::AllTrue(floats, weak)) log_squared = hn::IfThenElse(weak, log_squared, hn::Log1p(floats, e));
    store(log_radiance_scale(T, factor, log_squared), packet.change_of_step, at);
  }
  // Rays with differentials stop where no series is exact enough.
  store(mul(differentials ? hn::IfThenElseZero(fits, scale) : scale, sum), to, at);
  if (!differentials && HWY_UNLIKELY(!hn::AllTrue(floats, fits)))
    bend_in_double<components, changes>(packet, from, part, to_bits(hn::Not(fits), at), to);
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
