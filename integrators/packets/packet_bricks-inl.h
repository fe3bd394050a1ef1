/// @file integrators/packets/packet_bricks-inl.h
/// The bricks of a packet's lanes. A part of packet_kernel-inl.h.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_BRICKS_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_BRICKS_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_BRICKS_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_BRICKS_TOGGLE
#endif

#include <algorithm>

#include <hwy/highway.h>

#include "integrators/packets/packet_cells-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

/// The bits of a vector's lanes, given those of the packet.
HWY_INLINE std::uint32_t bits_of_vector(std::uint32_t packet, int at) { return packet >> at & ((1u << lanes) - 1); }

/// The brick of a lane. It is not compared with that of the lane before: where rays part, this costs more than it
/// saves.
HWY_INLINE TensorBrick brick_of(const PacketMedium& medium, const Packet& packet, int lane) {
  const std::int32_t at[3] = {packet.brick[0][lane], packet.brick[1][lane], packet.brick[2][lane]};
  return medium.brick(at);
}

/// Finds the bricks of some lanes. `wanted` has one bit for each lane; other lanes of their vectors keep their bricks.
HWY_INLINE void find_bricks(const PacketMedium& medium, Packet& packet, std::uint32_t wanted) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    std::uint32_t rest = bits_of_vector(wanted, i);
    if (rest == 0) continue;
    const auto same = [&](int axis) HWY_ATTR {
      return hn::Eq(hn::Load(ints, packet.brick[axis] + i), hn::Set(ints, packet.brick[axis][i]));
    };
    if (hn::AllTrue(ints, hn::And(same(0), hn::And(same(1), same(2))))) {
      const TensorBrick brick = brick_of(medium, packet, i);
      std::fill_n(packet.bending + i, lanes, brick.bending);
      store(set(brick.strongest), packet.strongest, i);
      continue;
    }
    for (; rest != 0; rest &= rest - 1) {
      const int lane = i + static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest));
      const TensorBrick brick = brick_of(medium, packet, lane);
      packet.bending[lane] = brick.bending;
      packet.strongest[lane] = brick.strongest;
    }
  }
}

/// Sets the values that depend on the strength of the lanes' bricks.
template <bool uniform>
HWY_INLINE void find_reach(const PacketMedium& medium, Packet& packet) {
  const F most = set(1e30f);
  const F longest = set(medium.longest_kick * (uniform ? 1.0f : medium.longest_voxel));
  const bool euler = medium.settings.method == BendingMethod::euler;  // The trace of T, which has no bound, affects it.
  F greatest = hn::Zero(floats);
  packet.straight = false;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F strongest = load(packet.strongest, i);
    F reach = hn::Mul(hn::Mul(hn::Abs(load(packet.kick, i)), longest), strongest);
    if (euler) reach = most;
    store(reach, packet.reach, i);
    const Mask long_steps = hn::Le(reach, set(strongest_kick));
    store(hn::IfThenZeroElse(long_steps, load(packet.bending_rate, i)), packet.bending_rate, i);
    greatest = hn::Max(greatest, hn::IfThenElse(hn::Le(reach, most), reach, most));  // NaN counts as strong.
    packet.straight |= !euler && !hn::AllFalse(floats, hn::Eq(strongest, hn::Zero(floats)));
  }
  packet.greatest_reach = hn::GetLane(hn::MaxOfLanes(floats, greatest));
  const bool weak = packet.greatest_reach <= strongest_kick;
  packet.varied = !uniform || packet.straight || medium.adaptive || (!weak && medium.settings.step == 0);
  packet.timed = packet.timed && !packet.varied;
}

/// Finds the box of the voxels, relative to the lanes' bricks.
HWY_INLINE void find_extent(const PacketMedium& medium, Packet& packet) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes)
    for (int axis = 0; axis < 3; ++axis) {
      const auto base = hn::Mul(hn::Load(ints, packet.brick[axis] + i), hn::Set(ints, TensorBrick::cells));
      const F low = hn::ConvertTo(floats, hn::Sub(hn::Set(ints, medium.first[axis]), base));
      const F high = hn::ConvertTo(floats, hn::Sub(hn::Set(ints, medium.last[axis]), base));
      store(low, packet.low[axis], i);
      store(high, packet.high[axis], i);
      store(hn::Max(hn::Sub(high, set(1)), low), packet.last[axis], i);
    }
}

/// Sets the values that depend on the lanes' bricks.
template <bool uniform>
HWY_INLINE void summarize(const PacketMedium& medium, Packet& packet) {
  find_reach<uniform>(medium, packet);
  auto apart = hn::Zero(ints), beyond = apart;
  for (int axis = 0; axis < 3; ++axis) {
    const auto first = hn::Set(ints, packet.brick[axis][0]);
    auto least = first, most = first;
    for (int i = 0; i < packet.vectors * lanes; i += lanes) {
      const auto brick = hn::Load(ints, packet.brick[axis] + i);
      least = hn::Min(least, brick);
      most = hn::Max(most, brick);
    }
    apart = hn::Or(apart, hn::Or(hn::Xor(least, first), hn::Xor(most, first)));
    beyond = hn::Or(beyond, hn::Or(hn::Sub(least, hn::Set(ints, medium.first_inner[axis])),
                                   hn::Sub(hn::Set(ints, medium.last_inner[axis]), most)));
  }
  const auto zero = hn::Zero(ints);
  packet.one_brick = hn::AllTrue(ints, hn::Eq(apart, zero));
  packet.near_border = !hn::AllFalse(ints, hn::Lt(beyond, zero));
  if (packet.near_border) find_extent(medium, packet);
  packet.near_surface = false;
  if (medium.settings.meets_surface)
    for (int lane = 0; lane < packet.vectors * lanes; ++lane) {
      const std::int32_t at[3] = {packet.brick[0][lane], packet.brick[1][lane], packet.brick[2][lane]};
      packet.near_surface |= medium.near_surface(at);
    }
  packet.watched =
      packet.near_border || packet.near_surface || medium.bounded || !(packet.greatest_reach <= strongest_kick);
}

/// Sets the values that depend on the rays of the lanes. Call it after lanes have been set.
template <bool uniform>
void begin(const PacketMedium& medium, Packet& packet) {
  packet.timed = false;
  find_bricks(medium, packet, ~0u >> (packet_rays - packet.vectors * lanes));
  summarize<uniform>(medium, packet);
}

/// Moves the lanes whose point is outside their brick to the brick of the point. `point(i)` gives the points of the
/// vector at lane i, relative to the lanes' bricks. `which` has the bits of lanes that may move.
template <bool uniform, class Point>
HWY_INLINE void move_to_bricks(const PacketMedium& medium, Packet& packet, std::uint32_t which, const Point& point) {
  const F zero = hn::Zero(floats), cells = set(TensorBrick::cells);
  std::uint32_t moved = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    if (bits_of_vector(which, i) == 0) continue;
    F3 cell = floor(point(i));
    // The cell between the last two voxels is the last one, also for points on its far face.
    if (packet.near_border) cell = minimum(cell, load(packet.last, i));
    const auto away = [](F to) HWY_ATTR { return hn::Floor(hn::Mul(to, set(1.0f / TensorBrick::cells))); };
    const F bricks[3] = {away(cell.x), away(cell.y), away(cell.z)};
    const Mask moves = hn::Or(hn::Ne(bricks[0], zero), hn::Or(hn::Ne(bricks[1], zero), hn::Ne(bricks[2], zero)));
    moved |= to_bits(moves, i);
    for (int axis = 0; axis < 3; ++axis) {
      store(hn::NegMulAdd(bricks[axis], cells, load(packet.p[axis], i)), packet.p[axis], i);
      std::int32_t* const brick = packet.brick[axis] + i;
      hn::Store(hn::Add(hn::Load(ints, brick), hn::ConvertTo(ints, bricks[axis])), ints, brick);
    }
  }
  find_bricks(medium, packet, moved);
  summarize<uniform>(medium, packet);
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
