/// @file integrators/kernels/packet_stages-inl.h
/// Steps of the methods other than splitting, from p and v to p_next and v_next. A part of packet_kernel-inl.h.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_STAGES_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_STAGES_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_STAGES_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_STAGES_TOGGLE
#endif

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include "integrators/kernels/packet_steps-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

/// The stages of a Runge–Kutta method: V in each stage, σ (T V − (VᵀTV) V / |V|²), and, for rays with differentials,
/// their derivatives along two parameters.
struct alignas(64) Stages {
  PerRay v[3][RungeKutta::most_stages][3], change[3][RungeKutta::most_stages][3];
  PerRay ahead[3];                             // Offset of the next stage's point from p, voxels.
  PerRay dp[2][3];                             // Derivatives of the position of that point.
  PerRay divergence[RungeKutta::most_stages];  // σ (tr T − 3 VᵀTV / |V|²) in each stage.
};

/// Σ_j factors[j] · rates[j].
HWY_INLINE F3 combine(const PerRay (&rates)[RungeKutta::most_stages][3], const double* factors, int count, int at) {
  F3 sum = zeros();
  for (int j = 0; j < count; ++j)
    if (factors[j] != 0) sum = mul_add(set(static_cast<float>(factors[j])), load(rates[j], at), sum);
  return sum;
}

/// Offset, in index space, after `time` along the direction `v` in world axes.
template <bool uniform>
HWY_INLINE F3 way(const PacketMedium& medium, F time, const F3& v) {
  return mul(time, index_direction<uniform>(medium, v));
}

/// Sets the state of a packet in a stage. `ahead` is its offset from p.
template <bool uniform, bool differentials>
HWY_INLINE void begin_stage(const PacketMedium& medium, const Packet& packet, int stage, Stages& stages) {
  const double* const factors = medium.stages->a[stage];
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F time = load(packet.time, i);
    const auto after = [&](const PerRay(&v)[3], int column) HWY_ATTR {
      return mul_add(time, combine(stages.change[column], factors, stage, i), load(v, i));
    };
    store(way<uniform>(medium, time, combine(stages.v[0], factors, stage, i)), stages.ahead, i);
    store(after(packet.v, 0), stages.v[0][stage], i);
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) {
        const F3 dway = way<uniform>(medium, time, combine(stages.v[k + 1], factors, stage, i));
        store(add(load(packet.dp[k], i), dway), stages.dp[k], i);
        store(after(packet.dv[k], k + 1), stages.v[k + 1][stage], i);
      }
  }
}

/// σ (tr T − 3 VᵀTV), which adding c I to T does not change.
HWY_INLINE F divergence(const Tensor& T, F strength, F along) {
  return hn::Mul(strength, hn::NegMulAdd(set(3), along, hn::Add(T.c[0], T.c[4])));
}

/// Eq. 5 and its derivatives, with the tensors as last sampled.
template <int components, bool differentials, bool changes>
HWY_INLINE void end_stage(const PacketMedium& medium, Packet& packet, int stage, Stages& stages) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F kick = load(packet.kick, i);
    const Tensor T = load_tensor<components>(packet, i);
    const F3 v = load(stages.v[0][stage], i), Tv = apply(T, v);
    const F inverse = hn::Div(set(1), dot(v, v)), along = hn::Mul(dot(v, Tv), inverse);
    const F3 change = mul_add(hn::Neg(along), v, Tv);
    store(mul(kick, change), stages.change[0][stage], i);
    if constexpr (changes) store(divergence(T, kick, along), stages.divergence[stage], i);
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) {
        const F3 dv = load(stages.v[k + 1][stage], i);
        const Tensor dT = tensor_along<components>(packet, along_slopes(medium, load(stages.dp[k], i)), i);
        const F3 dTv = add(apply(T, dv), apply(dT, v));
        // v·change is 0, because Tv = along · v + change.
        const F dalong = hn::Mul(inverse, hn::Sub(hn::Add(dot(dv, change), dot(v, dTv)), hn::Mul(along, dot(v, dv))));
        const F3 dchange = mul_add(hn::Neg(dalong), v, mul_add(hn::Neg(along), dv, dTv));
        store(mul(kick, dchange), stages.change[k + 1][stage], i);
      }
    if (stage == medium.stages->stages - 1) keep_bending_rate(medium, packet, T, i);
  }
}

/// Stores v, scaled to unit length, and its derivatives as the packet's next.
template <bool uniform, bool differentials>
HWY_INLINE void keep_unit(const PacketMedium& medium, Packet& packet, const F3& v, const F3 (&dv)[2], int at) {
  const F inverse = hn::Div(set(1), hn::Sqrt(dot(v, v)));
  const F3 unit = mul(inverse, v);
  store(unit, packet.v_next, at);
  if constexpr (!uniform) store(index_direction<uniform>(medium, unit), packet.u_next, at);
  if constexpr (differentials)
    for (int k = 0; k < 2; ++k) {
      const F3 change = mul(inverse, dv[k]);
      store(mul_add(hn::Neg(dot(unit, change)), unit, change), packet.dv_next[k], at);
    }
}

/// The error of an adaptive step divided by the tolerance. The error is the greater of that in voxels along the ray and
/// that in radians.
template <bool uniform>
HWY_INLINE F find_excess(const PacketMedium& medium, const Packet& packet, const Stages& stages, int at) {
  const double* const factors = medium.stages->error;
  const int count = medium.stages->stages;
  const F3 by_v = combine(stages.v[0], factors, count, at), by_change = combine(stages.change[0], factors, count, at);
  const F unit = set(uniform ? 1 : medium.unit);
  const F3 change = mul(unit, by_change);
  F squares = dot(by_v, by_v);
  if constexpr (!uniform) squares = hn::Mul(squares, squared_voxels_per_unit(medium, packet, at));
  const F greater = hn::Sqrt(hn::Max(squares, dot(change, change)));
  return hn::Mul(hn::Mul(hn::Div(load(packet.time, at), unit), greater), set(1 / medium.settings.tolerance));
}

template <bool uniform, bool differentials, bool changes>
HWY_INLINE void combine_stages(const PacketMedium& medium, Packet& packet, const Stages& stages) {
  const double* const factors = medium.stages->b;
  const int count = medium.stages->stages;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F time = load(packet.time, i);
    const auto after = [&](const PerRay(&v)[3], int column) HWY_ATTR {
      return mul_add(time, combine(stages.change[column], factors, count, i), load(v, i));
    };
    store(add(load(packet.p, i), way<uniform>(medium, time, combine(stages.v[0], factors, count, i))), packet.p_next,
          i);
    F3 dv[2];
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) {
        const F3 dway = way<uniform>(medium, time, combine(stages.v[k + 1], factors, count, i));
        store(add(load(packet.dp[k], i), dway), packet.dp_next[k], i);
        dv[k] = after(packet.dv[k], k + 1);
      }
    keep_unit<uniform, differentials>(medium, packet, after(packet.v, 0), dv, i);
    if constexpr (changes) {
      F change = hn::Zero(floats);
      for (int j = 0; j < count; ++j)
        change = hn::MulAdd(set(static_cast<float>(factors[j])), load(stages.divergence[j], i), change);
      store(hn::Mul(time, change), packet.change_of_step, i);
    }
    if (medium.adaptive) store(find_excess<uniform>(medium, packet, stages, i), packet.excess, i);
  }
}

/// A step of a Runge–Kutta method.
template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_NOINLINE void step_by_stages(const PacketMedium& medium, Packet& packet) {
  Stages stages;
  bool near_border = false, near_surface = false;  // In any brick that is sampled.
  for (int stage = 0; stage < medium.stages->stages; ++stage) {
    begin_stage<uniform, differentials>(medium, packet, stage, stages);
    locate<Bricks, uniform, differentials>(
        medium, packet, [&](int i) HWY_ATTR { return add(load(packet.p, i), load(stages.ahead, i)); });
    near_border |= packet.near_border;
    near_surface |= packet.near_surface;
    interpolate<Bricks, uniform, differentials>(packet);
    end_stage<Bricks::components, differentials, changes>(medium, packet, stage, stages);
  }
  packet.near_border |= near_border;
  packet.near_surface |= near_surface;
  combine_stages<uniform, differentials, changes>(medium, packet, stages);
}

/// T₂₂ and its slopes at the points where the lanes' tensors were sampled.
template <class Bricks>
HWY_INLINE Slopes<F> sample_trailing(const Packet& packet, int at) {
  constexpr int components = Bricks::components;
  if constexpr (Bricks::cubic) return sample_trailing_spline<components>(packet, at);
  alignas(64) float values[8][lanes];
  const auto corner = [&](int lane, int k) HWY_ATTR {
    const int voxel = static_cast<int>(packet.voxel[at + lane]) + corners[k];
    return packet.bending[at + lane][TensorBrick::trailing_offset(components) + voxel];
  };
  for (int lane = 0; lane < (packet.one_cell ? 0 : lanes); ++lane)
    for (int k = 0; k < 8; ++k) values[k][lane] = corner(lane, k);
  const auto value = [&](int k) HWY_ATTR { return packet.one_cell ? set(corner(0, k)) : hn::Load(floats, values[k]); };
  const F3 fraction = load(packet.fraction, at);
  return evaluate(polynomial<F>(value), fraction.x, fraction.y, fraction.z);
}

/// A step of Euler's method (Eq. 3–4), which the trace of T affects.
template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_NOINLINE void step_by_euler(const PacketMedium& medium, Packet& packet) {
  constexpr int components = Bricks::components;
  locate<Bricks, uniform, differentials>(medium, packet, [&](int i) HWY_ATTR { return load(packet.p, i); });
  interpolate<Bricks, uniform, differentials>(packet);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F time = load(packet.time, i), factor = hn::Mul(time, load(packet.kick, i));
    const Tensor T = load_tensor<components>(packet, i);
    const Slopes<F> trailing = sample_trailing<Bricks>(packet, i);
    const F3 v = load(packet.v, i);
    F3 dv[2];
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) {
        const F3 along = along_slopes(medium, load(packet.dp[k], i)), before = load(packet.dv[k], i);
        const F dtrailing = dot(along, {trailing.x, trailing.y, trailing.z});
        const F3 bent = add(apply(T, before), apply(tensor_along<components>(packet, along, i), v));
        dv[k] = mul_add(factor, mul_add(trailing.value, before, mul_add(dtrailing, v, bent)), before);
      }
    const F3 Tv = apply(T, v), after = mul_add(factor, mul_add(trailing.value, v, Tv), v);
    if constexpr (changes) store(divergence(T, factor, dot(v, Tv)), packet.change_of_step, i);
    keep_unit<uniform, differentials>(medium, packet, after, dv, i);
    keep_bending_rate(medium, packet, T, i);
    const auto on = [&](const PerRay(&p)[3], const PerRay(&along)[3])
                        HWY_ATTR { return add(load(p, i), way<uniform>(medium, time, load(along, i))); };
    store(on(packet.p, packet.v_next), packet.p_next, i);
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) store(on(packet.dp[k], packet.dv_next[k]), packet.dp_next[k], i);
  }
}

/// Sets the first steps of adaptive methods.
template <bool uniform>
HWY_NOINLINE void begin_steps(const PacketMedium& medium, Packet& packet) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F voxel = voxel_along<uniform>(medium, packet, i);
    store(automatic_step(medium, load(packet.bending_rate, i), voxel), packet.wanted, i);
  }
}

/// The lanes whose steps are too short for single precision, as bits.
template <bool uniform>
HWY_INLINE std::uint32_t too_short(const PacketMedium& medium, const Packet& packet) {
  std::uint32_t result = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F time = hn::Div(load(packet.time, i), set(uniform ? 1 : medium.unit));
    F squares = hn::Mul(time, time);
    if constexpr (!uniform) squares = hn::Mul(squares, squared_voxels_per_unit(medium, packet, i));
    result |= to_bits(hn::Not(hn::Ge(squares, set(shortest_step * shortest_step))), i);
  }
  return result;
}

/// Leaves a lane where it is.
template <bool uniform, bool differentials>
HWY_INLINE void hold(Packet& packet, int lane) {
  packet.time[lane] = 0;
  packet.change_of_step[lane] = 0;
  for (int axis = 0; axis < 3; ++axis) {
    packet.p_next[axis][lane] = packet.p[axis][lane];
    packet.v_next[axis][lane] = packet.v[axis][lane];
    if constexpr (!uniform) packet.u_next[axis][lane] = packet.u[axis][lane];
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) {
        packet.dp_next[k][axis][lane] = packet.dp[k][axis][lane];
        packet.dv_next[k][axis][lane] = packet.dv[k][axis][lane];
      }
  }
}

/// The next adaptive step divided by the last one: see step_lengths.h.
HWY_INLINE F growth(const PacketMedium& medium, F excess) {
  using namespace step_lengths;
  const int order = medium.composed ? composed_order : medium.stages->order;
  const auto single = [](double value) HWY_ATTR { return set(static_cast<float>(value)); };
  const F within = hn::Min(hn::Max(excess, single(least_excess)), set(1e30f));
  const F root = hn::Exp(floats, hn::Mul(single(-1.0 / order), hn::Log(floats, within)));
  const F factor = hn::Mul(single(medium.composed ? composed_safety : safety), root), least = single(least_growth),
          most = single(most_growth);
  return hn::IfThenElse(hn::Eq(excess, excess), hn::Min(hn::Max(factor, least), most), least);
}

/// Sets the next adaptive steps from the errors of these. Lanes with too great an error stay.
/// @return the lanes that stay, as bits.
template <bool uniform, bool differentials>
HWY_NOINLINE std::uint32_t control_steps(const PacketMedium& medium, Packet& packet) {
  std::uint32_t staying = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F excess = load(packet.excess, i), wanted = load(packet.wanted, i);
    store(hn::Min(hn::Mul(wanted, growth(medium, excess)), set(medium.longest_step)), packet.wanted, i);
    const F3 v = load(packet.v_next, i);  // A lane without a direction does not stay: it stops, whatever its error.
    staying |= to_bits(hn::And(hn::Gt(excess, set(1)), hn::Gt(dot(v, v), hn::Zero(floats))), i);
  }
  for (std::uint32_t rest = staying; rest != 0; rest &= rest - 1)
    hold<uniform, differentials>(packet, static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest)));
  return staying;
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
