/// @file integrators/kernels/packet_steps-inl.h
/// A step of a packet, in three parts: to its middle, the tensors there, the kick and the second half. A part of
/// packet_kernel-inl.h.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_STEPS_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_STEPS_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_STEPS_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_STEPS_TOGGLE
#endif

#include <algorithm>
#include <cmath>

#include <hwy/highway.h>

#include "integrators/kernels/packet_bending-inl.h"
#include "integrators/packets/packet_bricks-inl.h"
#include "integrators/packets/packet_cells-inl.h"
#include "integrators/packets/packet_splines-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

// Template arguments: `Bricks`: LinearBricks or CubicBricks. `uniform`: voxels are cubes along the axes.
// `differentials`: rays have differentials. `changes`: the change of radiance is wanted.

/// The change of position per unit of `time`, in index space: V if voxels are uniform (time in voxels), else u (time in
/// world units).
template <bool uniform>
HWY_INLINE const PerRay (&direction(const Packet& packet))[3] {
  return uniform ? packet.v : packet.u;
}

template <bool uniform>
HWY_INLINE F3 index_direction(const PacketMedium& medium, const F3& v) {
  if (uniform) return {v.x, v.y, v.z};
  const auto& m = medium.to_index;
  const auto row = [&](int i) HWY_ATTR {
    return hn::MulAdd(set(m[i][0]), v.x, hn::MulAdd(set(m[i][1]), v.y, hn::Mul(set(m[i][2]), v.z)));
  };
  return {row(0), row(1), row(2)};
}

/// The last step of lanes in bricks where nothing bends light ended a little beyond these bricks. This moves the lanes
/// to the bricks where they are now. (Other lanes move when the middles of their steps are located. What their
/// neighbours do does not matter.)
template <bool uniform>
HWY_NOINLINE void leave_straight_bricks(const PacketMedium& medium, Packet& packet) {
  const F zero = hn::Zero(floats), end = set(TensorBrick::cells);
  const auto moves = [&](int i) HWY_ATTR {
    const F3 p = load(packet.p, i);
    const auto beyond = [&](F x) HWY_ATTR { return hn::Or(hn::Lt(x, zero), hn::Ge(x, end)); };
    return hn::And(hn::Eq(load(packet.strongest, i), zero), hn::Or(beyond(p.x), hn::Or(beyond(p.y), beyond(p.z))));
  };
  std::uint32_t any = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) any |= to_bits(moves(i), i);
  if (any == 0) return;
  move_to_bricks<uniform>(medium, packet, any, [&](int i) HWY_ATTR {
    const F3 p = load(packet.p, i);
    return select(moves(i), packet.near_border ? clamp(p, load(packet.low, i), load(packet.high, i)) : p, zeros());
  });
}

/// Length of an automatic step of methods with fixed steps, voxels, if one voxel has the length `voxel`. @p
/// bending_rate is that of a packet.
HWY_INLINE F automatic_step(const PacketMedium& medium, F bending_rate, F voxel) {
  const bool splitting = medium.settings.method == BendingMethod::splitting;
  const F shortest = set(splitting ? static_cast<float>(step_lengths::shortest_splitting) : 0.0f);
  const bool composed = medium.composed;
  const F longest =
      set(static_cast<float>(composed ? step_lengths::longest_composed : step_lengths::longest_automatic));
  const F strongest = set(composed ? static_cast<float>(step_lengths::strongest_composed) : strongest_kick);
  const F kick = hn::Mul(bending_rate, voxel);
  return hn::IfThenElse(hn::Gt(hn::Mul(kick, longest), strongest), hn::Max(hn::Div(strongest, kick), shortest),
                        longest);
}

/// |u|², voxels per `medium.unit`. (In world units, the squares may be beyond single precision.)
HWY_INLINE F squared_voxels_per_unit(const PacketMedium& medium, const Packet& packet, int at) {
  const F3 u = mul(set(medium.unit), load(packet.u, at));
  return dot(u, u);
}

/// Length of a voxel along the rays, in the units of `time`.
template <bool uniform>
HWY_INLINE F voxel_along(const PacketMedium& medium, const Packet& packet, int at) {
  if (uniform) return set(1);
  return hn::Div(set(medium.unit), hn::Sqrt(squared_voxels_per_unit(medium, packet, at)));
}

/// Sets the length of the next step: in voxels, or, if voxels are not uniform, in world units.
template <bool uniform>
HWY_NOINLINE void find_times(const PacketMedium& medium, Packet& packet) {
  if (packet.straight) leave_straight_bricks<uniform>(medium, packet);
  const bool automatic = medium.settings.step == 0 && !(packet.greatest_reach <= strongest_kick);
  const F zero = hn::Zero(floats), end = set(TensorBrick::cells);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F voxel = voxel_along<uniform>(medium, packet, i);
    const F steps = medium.adaptive ? load(packet.wanted, i)
                    : automatic     ? automatic_step(medium, load(packet.bending_rate, i), voxel)
                                    : set(medium.longest_step);
    F time = uniform ? steps : hn::Mul(steps, voxel);
    if (packet.straight) {
      // The step ends a little beyond the brick where nothing bends light, so that rounding does not keep the ray in
      // the brick.
      const F3 p = load(packet.p, i), u = load(direction<uniform>(packet), i);
      const auto way = [&](F x, F along) HWY_ATTR {
        const F to = hn::Sub(hn::IfThenElse(hn::Gt(along, zero), end, zero), x);
        return hn::IfThenElse(hn::Eq(along, zero), set(1e30f), hn::Div(to, along));
      };
      const F out = hn::Min(hn::Min(way(p.x, u.x), way(p.y, u.y)), way(p.z, u.z));
      const auto within = [&](F x) HWY_ATTR { return hn::And(hn::Ge(x, zero), hn::Le(x, end)); };
      const Mask crosses = hn::And(hn::And(within(p.x), hn::And(within(p.y), within(p.z))),
                                   hn::And(hn::Eq(load(packet.strongest, i), zero), hn::Lt(out, set(1e29f))));
      time = hn::IfThenElse(crosses, hn::MulAdd(set(medium.past_straight_brick), voxel, out), time);
    }
    store(time, packet.time, i);
  }
  packet.timed = !packet.varied;
}

/// Finds the sample points (`point_of(i)` gives those of the vector at lane i), their cells, and the values that
/// interpolation needs. `careful`: the packet clamps, or, with `moved`, points outside their bricks count as on the
/// faces of the bricks.
/// @param moved  Bits of lanes; only their vectors are found again. 0: all vectors.
/// @return bits of the lanes whose points are not within their bricks.
template <class Bricks, bool differentials, bool careful, class Point>
HWY_INLINE std::uint32_t find_cells(Packet& packet, std::uint32_t moved, const Point& point_of) {
  const F last = set(Bricks::cells - 1), width = set(Bricks::width);
  std::uint32_t beyond = 0;
  F first = hn::Zero(floats);
  Mask same = hn::Eq(first, first);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    if (!careful || moved == 0 || bits_of_vector(moved, i) != 0) {
      F3 point = point_of(i);
      store(point, packet.middle, i);
      if (careful && packet.clamps) point = clamp(point, load(packet.low, i), load(packet.high, i));
      F3 near = floor(point);
      if (careful && packet.clamps) near = clamp(near, load(packet.low, i), load(packet.last, i));
      // As unsigned integers, negative floats are the greatest.
      const auto greatest =
          hn::Max(hn::BitCast(bits, near.x), hn::Max(hn::BitCast(bits, near.y), hn::BitCast(bits, near.z)));
      beyond |= to_bits(hn::RebindMask(floats, hn::Gt(greatest, hn::BitCast(bits, last))), i);
      if (careful && moved != 0) near = clamp(near, zeros(), {last, last, last});
      store(sub(point, near), packet.fraction, i);
      store(hn::MulAdd(hn::MulAdd(near.x, width, near.y), width, near.z), packet.voxel, i);
    }
    const F voxel = load(packet.voxel, i);
    if (i == 0) first = set(hn::GetLane(voxel));
    same = hn::And(same, hn::Eq(voxel, first));
  }
  packet.one_cell = packet.one_brick && hn::AllTrue(floats, same);
  return beyond;
}

/// Finds the sample points, and moves lanes to the bricks of these points.
template <class Bricks, bool uniform, bool differentials, class Point>
HWY_INLINE void locate(const PacketMedium& medium, Packet& packet, const Point& point_of) {
  const std::uint32_t beyond = packet.clamps ? find_cells<Bricks, differentials, true>(packet, 0, point_of)
                                             : find_cells<Bricks, differentials, false>(packet, 0, point_of);
  packet.moved = beyond;
  if (HWY_LIKELY(beyond == 0)) return;
  move_to_bricks<uniform>(medium, packet, beyond, [&](int i) HWY_ATTR {
    const F3 point = load(packet.middle, i);
    return packet.clamps ? clamp(point, load(packet.low, i), load(packet.high, i)) : point;
  });
  // The remaining points are outside the extent, or rounding put them on a face.
  find_cells<Bricks, differentials, true>(packet, beyond, point_of);
}

/// The first part of a step: locates its middle.
template <class Bricks, bool uniform, bool differentials>
HWY_INLINE void locate_middles(const PacketMedium& medium, Packet& packet) {
  locate<Bricks, uniform, differentials>(medium, packet, [&](int i) HWY_ATTR {
    const F half = hn::Mul(set(0.5f), load(packet.time, i));
    return mul_add(half, load(direction<uniform>(packet), i), load(packet.p, i));
  });
}

/// Offsets, in floats within the lanes' bricks, of the cells where the lanes of a vector will be after two long steps;
/// beyond a brick, of any of its cells.
template <int components, bool uniform>
HWY_INLINE hn::Vec<Bits> find_cells_ahead(const Packet& packet, int at) {
  const F3 cells = floor(add(load(packet.fraction, at), load(direction<uniform>(packet), at)));
  constexpr int last_cell = TensorBrick::cells - 1;
  const F width = set(TensorBrick::width), last = set(TensorBrick::voxel(last_cell, last_cell, last_cell));
  const F voxels = hn::MulAdd(hn::MulAdd(cells.x, width, cells.y), width, cells.z);
  const F voxel = hn::Add(load(packet.voxel, at), voxels);
  return offsets_of<components>(hn::Min(hn::Max(voxel, hn::Zero(floats)), last));
}

/// The second part of a step: samples the tensors there.
template <class Bricks, bool uniform, bool differentials>
HWY_INLINE void interpolate(Packet& packet) {
  constexpr int components = Bricks::components;
  if constexpr (Bricks::cubic) return sample_splines<components, differentials>(packet);
  if (!differentials && HWY_LIKELY(packet.one_cell)) {
    const auto ahead = hn::GetLane(find_cells_ahead<components, uniform>(packet, 0));
    prefetch_cell<components>(packet.bending[0] + ahead);
    return sample_cell<components>(cell_of<components>(packet, 0), packet, 0, packet.vectors);
  }
  Offsets offsets;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F voxel = load(packet.voxel, i);
    hn::Store(offsets_of<components>(voxel), bits, offsets.near + i);
    hn::Store(offsets_of<components>(hn::Add(voxel, set(1))), bits, offsets.far + i);
    hn::Store(find_cells_ahead<components, uniform>(packet, i), bits, offsets.ahead + i);
  }
  // Nothing has asked for these cells before.
  for (std::uint32_t rest = packet.moved; rest != 0; rest &= rest - 1) {
    const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(rest);
    prefetch_cell<components>(packet.bending[lane] + offsets.near[lane]);
  }
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const bool together = in_one_cell(packet, i);
    if constexpr (differentials) {
      if (together)
        sample_slopes<components>(cell_of<components>(packet, i), packet, i);
      else
        sample_own_slopes<components>(packet, i, offsets);
    } else {
      if (together)
        sample_cell<components>(cell_of<components>(packet, i), packet, i, 1);
      else
        sample_own_cells<components>(packet, i, offsets);
    }
  }
}

/// The first two parts of a step, where it is not among the most frequent ones: compiled once for all who need it.
template <class Bricks, bool uniform, bool differentials>
HWY_NOINLINE void sample_middles(const PacketMedium& medium, Packet& packet) {
  locate_middles<Bricks, uniform, differentials>(medium, packet);
  interpolate<Bricks, uniform, differentials>(packet);
}

/// A change of position, without its components along axes of a single voxel, where the tensor does not change.
HWY_INLINE F3 along_slopes(const PacketMedium& medium, const F3& dp) {
  return {hn::Mul(dp.x, set(medium.slope[0])), hn::Mul(dp.y, set(medium.slope[1])),
          hn::Mul(dp.z, set(medium.slope[2]))};
}

/// Change of the tensor if the position changes by `along`.
template <int components>
HWY_INLINE Tensor tensor_along(const Packet& packet, const F3& along, int at) {
  return tensor_of<components>([&](int i) HWY_ATTR {
    return dot(along, {load(packet.slopes[0][i], at), load(packet.slopes[1][i], at), load(packet.slopes[2][i], at)});
  });
}

/// The derivatives of exp(factor · T) V, normalised, along a parameter along which T and V change by dT and dv. They
/// are the derivatives of the method's own steps. The series has one more term than without derivatives, because
/// differentiation removes one.
HWY_INLINE F3 bend_differential(const Tensor& T, const Tensor& dT, const F3& v, const F3& dv, F factor, F size) {
  F3 term = v, sum = v, dterm = dv, dsum = dterm;
  for (int n = 1; n <= most_terms; ++n) {
    const Mask needed = hn::Gt(size, set(n < 4 ? -1.0f : series_reach[n - 4]));
    if (hn::AllFalse(floats, needed)) break;
    const F part = hn::Mul(set(1.0f / static_cast<float>(n)), factor);
    dterm = mul(part, add(apply(T, dterm), apply(dT, term)));
    term = mul(part, apply(T, term));
    sum = add(sum, select(needed, term, zeros()));
    dsum = add(dsum, select(needed, dterm, zeros()));
  }
  const F inverse = hn::Div(set(1), hn::Sqrt(dot(sum, sum)));
  const F3 unit = mul(inverse, sum), change = mul(inverse, dsum);
  return mul_add(hn::Neg(dot(unit, change)), unit, change);
}

/// The derivatives, along two parameters, of the directions and positions at the end of the step.
template <int components, bool uniform>
HWY_INLINE void bend_differentials(const PacketMedium& medium, Packet& packet, const Tensor& T, const F3& v, F factor,
                                   int at) {
  const F size = load(packet.size, at), half = hn::Mul(set(0.5f), load(packet.time, at));
  for (int i = 0; i < 2; ++i) {
    const F3 before = load(packet.dv[i], at);
    const F3 dmiddle = mul_add(half, index_direction<uniform>(medium, before), load(packet.dp[i], at));
    const Tensor dT = tensor_along<components>(packet, along_slopes(medium, dmiddle), at);
    const F3 dv = bend_differential(T, dT, v, before, factor, size);
    store(dv, packet.dv_next[i], at);
    store(mul_add(half, index_direction<uniform>(medium, dv), dmiddle), packet.dp_next[i], at);
  }
}

/// The third part of a step: bends the rays, and moves from the middle to the positions and directions at the end. The
/// results may overwrite those of the packet. `weakly`: no lane needs more than two terms.
template <class Bricks, bool uniform, bool differentials, bool changes, bool weakly>
HWY_INLINE void take_step_as(const PacketMedium& medium, Packet& packet, PerRay (&p)[3], PerRay (&v)[3],
                             PerRay (&u)[3]) {
  constexpr int components = Bricks::components;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F time = load(packet.time, i), factor = hn::Mul(time, load(packet.kick, i)), half = hn::Mul(set(0.5f), time);
    const Tensor T = load_tensor<components>(packet, i);
    const F3 before = load(packet.v, i);
    if constexpr (weakly)
      store(bend_weakly<changes>(packet, T, before, factor, i), v, i);
    else
      bend_strongly<components, differentials, changes>(packet, T, packet.v, before, 1, factor, i, v);
    if constexpr (differentials) bend_differentials<components, uniform>(medium, packet, T, before, factor, i);
    const F3 after = load(v, i);
    if constexpr (uniform) {
      store(mul_add(half, after, load(packet.middle, i)), p, i);
    } else {
      const F3 along = index_direction<uniform>(medium, after);
      store(along, u, i);
      store(mul_add(half, along, load(packet.middle, i)), p, i);
    }
  }
}

template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_INLINE void take_step(const PacketMedium& medium, Packet& packet, PerRay (&p)[3], PerRay (&v)[3], PerRay (&u)[3]) {
  if (!differentials && HWY_LIKELY(packet.greatest_reach <= series_reach[0]))
    return take_step_as<Bricks, uniform, differentials, changes, true>(medium, packet, p, v, u);
  take_step_as<Bricks, uniform, differentials, changes, false>(medium, packet, p, v, u);
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
