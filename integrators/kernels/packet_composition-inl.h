/// @file integrators/kernels/packet_composition-inl.h
/// A step of `splitting4`, from p and v to p_next and v_next, and the path between them. A part of packet_kernel-inl.h.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_COMPOSITION_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_COMPOSITION_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_COMPOSITION_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_COMPOSITION_TOGGLE
#endif

#include <hwy/highway.h>

#include "integrators/kernels/packet_steps-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

/// The rays of a packet within a step.
struct alignas(64) ComposedStep {
  PerRay ahead[3];  // Offset from p, voxels. (p itself moves when lanes enter other bricks.)
  PerRay v[3];
  PerRay error[3];  // Σ error[j] V_j.
  PerRay dp[2][3], dv[2][3];
  PerRay change;  // Λ so far.
};

template <bool differentials, bool changes>
HWY_INLINE void begin_step(const Packet& packet, ComposedStep& step) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F3 v = load(packet.v, i);
    store(zeros(), step.ahead, i);
    store(v, step.v, i);
    store(mul(set(static_cast<float>(splitting4_method.error[0])), v), step.error, i);
    if constexpr (changes) store(hn::Zero(floats), step.change, i);
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) {
        store(load(packet.dp[k], i), step.dp[k], i);
        store(load(packet.dv[k], i), step.dv[k], i);
      }
  }
}

/// Moves the rays along their directions for the part `part` of the step.
template <bool uniform, bool differentials>
HWY_INLINE void drift(const PacketMedium& medium, const Packet& packet, double part, ComposedStep& step) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F time = hn::Mul(set(static_cast<float>(part)), load(packet.time, i));
    const auto moved = [&](const PerRay(&p)[3], const PerRay(&v)[3])
                           HWY_ATTR { return mul_add(time, index_direction<uniform>(medium, load(v, i)), load(p, i)); };
    store(moved(step.ahead, step.v), step.ahead, i);
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) store(moved(step.dp[k], step.dv[k]), step.dp[k], i);
  }
}

/// V ← exp(part · σ h T) V, normalised, with the tensors as last sampled.
template <int components, bool differentials, bool changes>
HWY_INLINE void kick(const PacketMedium& medium, Packet& packet, double part, ComposedStep& step) {
  const float single = static_cast<float>(part);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F factor = hn::Mul(hn::Mul(set(single), load(packet.time, i)), load(packet.kick, i));
    const Tensor T = load_tensor<components>(packet, i);
    const F3 before = load(step.v, i);
    bend_strongly<components, differentials, changes>(packet, T, step.v, before, single, factor, i, packet.v_next);
    if constexpr (changes) store(hn::Add(load(step.change, i), load(packet.change_of_step, i)), step.change, i);
    if constexpr (differentials) {
      const F size = load(packet.size, i);
      for (int k = 0; k < 2; ++k) {
        const Tensor dT = tensor_along<components>(packet, along_slopes(medium, load(step.dp[k], i)), i);
        store(bend_differential(T, dT, before, load(step.dv[k], i), factor, size), step.dv[k], i);
      }
    }
    store(load(packet.v_next, i), step.v, i);
  }
}

/// Stores the end of the step as the packet's next, and the error estimate divided by the tolerance.
template <bool uniform, bool differentials, bool changes>
HWY_INLINE void end_composed(const PacketMedium& medium, Packet& packet, const ComposedStep& step) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F3 v = load(step.v, i);
    store(add(load(packet.p, i), load(step.ahead, i)), packet.p_next, i);
    store(v, packet.v_next, i);
    if constexpr (!uniform) store(index_direction<uniform>(medium, v), packet.u_next, i);
    if constexpr (changes) store(load(step.change, i), packet.change_of_step, i);
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) {
        store(load(step.dp[k], i), packet.dp_next[k], i);
        store(load(step.dv[k], i), packet.dv_next[k], i);
      }
    if (!medium.adaptive) continue;
    const F3 error = load(step.error, i);
    F squares = dot(error, error);
    if constexpr (!uniform) squares = hn::Mul(squares, squared_voxels_per_unit(medium, packet, i));
    const F time = hn::Div(load(packet.time, i), set(uniform ? 1 : medium.unit));
    store(hn::Mul(hn::Mul(time, hn::Sqrt(squares)), set(1 / medium.settings.tolerance)), packet.excess, i);
  }
}

template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_NOINLINE void step_by_composition(const PacketMedium& medium, Packet& packet) {
  ComposedStep step;
  begin_step<differentials, changes>(packet, step);
  bool near_surface = false, watched = false;  // In any brick that is sampled.
  for (int n = 0; n < Composition::kicks; ++n) {
    drift<uniform, differentials>(medium, packet, splitting4_method.drift[n], step);
    locate<Bricks, uniform, differentials>(medium, packet,
                                           [&](int i) HWY_ATTR { return add(load(packet.p, i), load(step.ahead, i)); });
    near_surface |= packet.near_surface;
    watched |= packet.watched;
    interpolate<Bricks, uniform, differentials>(packet);
    kick<Bricks::components, differentials, changes>(medium, packet, splitting4_method.kick[n], step);
    const F weight = set(static_cast<float>(splitting4_method.error[n + 1]));
    for (int i = 0; i < packet.vectors * lanes; i += lanes)
      store(mul_add(weight, load(step.v, i), load(step.error, i)), step.error, i);
  }
  packet.near_surface |= near_surface;
  packet.watched |= watched;
  drift<uniform, differentials>(medium, packet, splitting4_method.drift[Composition::kicks], step);
  end_composed<uniform, differentials, changes>(medium, packet, step);
}

/// The path at the part t of the step (see path_weights), or its derivative by t, in index space.
template <bool uniform>
HWY_INLINE F3 path_at(const Packet& packet, const PathWeights& weights, int at) {
  const F time = load(packet.time, at);
  const auto along = [&](double weight, const F3& v)
                         HWY_ATTR { return mul(hn::Mul(set(static_cast<float>(weight)), time), v); };
  const auto at_end = [&](double weight, const F3& p) HWY_ATTR { return mul(set(static_cast<float>(weight)), p); };
  const F3 v = uniform ? load(packet.v, at) : load(packet.u, at);
  const F3 v_next = uniform ? load(packet.v_next, at) : load(packet.u_next, at);
  return add(add(at_end(weights.from, load(packet.p, at)), along(weights.from_direction, v)),
             add(at_end(weights.to, load(packet.p_next, at)), along(weights.to_direction, v_next)));
}

/// The lanes that turn on their way along an axis, or may do so, as bits: there the path's cubic polynomial may cross a
/// face more than once.
template <bool uniform>
HWY_NOINLINE std::uint32_t turning(const Packet& packet, int axis) {
  const PerRay &u = uniform ? packet.v[axis] : packet.u[axis],
               &u_next = uniform ? packet.v_next[axis] : packet.u_next[axis];
  std::uint32_t result = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F way = hn::Sub(load(packet.p_next[axis], i), load(packet.p[axis], i)), time = load(packet.time, i);
    const auto is_steady = [&](const PerRay& slope) HWY_ATTR {  // Sufficient where it holds at both ends.
      const F part = hn::Div(hn::Mul(time, load(slope, i)), way);
      return hn::And(hn::Ge(part, hn::Zero(floats)), hn::Le(part, set(3)));
    };
    result |= to_bits(hn::Not(hn::And(is_steady(u), is_steady(u_next))), i);
  }
  return result;
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
