/// @file integrators/packets/packet_bricks-inl.h
/// The bricks of a packet's lanes. A part of packet_kernel.cpp.

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

/// Looks up bricks. The lanes of a packet are often in the brick of the lane before.
struct BrickLookup {
  const PacketMedium& medium;
  std::int32_t at[3] = {};
  TensorBrick brick{};

  HWY_INLINE const TensorBrick& of_lane(const Packet& packet, int lane) {
    const std::int32_t to[3] = {packet.brick[0][lane], packet.brick[1][lane], packet.brick[2][lane]};
    if (!brick.bending || ((to[0] ^ at[0]) | (to[1] ^ at[1]) | (to[2] ^ at[2])) != 0) {
      for (int axis = 0; axis < 3; ++axis) at[axis] = to[axis];
      brick = medium.brick(at);
    }
    return brick;
  }
};

/// Finds the bricks of some lanes. `wanted` has one bit for each lane; other lanes of their vectors keep their bricks.
HWY_INLINE void find_bricks(const PacketMedium& medium, Packet& packet, std::uint32_t wanted) {
  BrickLookup lookup{medium};
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    std::uint32_t rest = bits_of_vector(wanted, i);
    if (rest == 0) continue;
    const auto same = [&](int axis) HWY_ATTR {
      return hn::Eq(hn::Load(ints, packet.brick[axis] + i), hn::Set(ints, packet.brick[axis][i]));
    };
    if (hn::AllTrue(ints, hn::And(same(0), hn::And(same(1), same(2))))) {
      const TensorBrick& brick = lookup.of_lane(packet, i);
      std::fill_n(packet.bending + i, lanes, brick.bending);
      store(set(brick.strongest), packet.strongest, i);
      continue;
    }
    for (; rest != 0; rest &= rest - 1) {
      const int lane = i + static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest));
      const TensorBrick& brick = lookup.of_lane(packet, lane);
      packet.bending[lane] = brick.bending;
      packet.strongest[lane] = brick.strongest;
    }
  }
}

/// Sets the values that depend on the strength of the lanes' bricks.
template <bool uniform>
HWY_INLINE void find_reach(const PacketMedium& medium, Packet& packet) {
  const F most = set(1e30f);
  const F longest = set(medium.longest_step * (uniform ? 1.0f : medium.longest_voxel));
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

/// Sets the values that depend on the lanes' bricks.
template <bool uniform>
HWY_INLINE void summarize(const PacketMedium& medium, Packet& packet) {
  find_reach<uniform>(medium, packet);
  // A step may begin a little outside its brick.
  const F near = set(-medium.longest_step - 1), far = set(TensorBrick::cells + medium.longest_step + 1);
  Mask border = hn::Lt(near, near), apart = border;
  for (int i = 0; i < packet.vectors * lanes; i += lanes)
    for (int axis = 0; axis < 3; ++axis) {
      const auto brick = hn::Load(ints, packet.brick[axis] + i);
      apart = hn::Or(apart, hn::RebindMask(floats, hn::Ne(brick, hn::Set(ints, packet.brick[axis][0]))));
      border = hn::Or(border, hn::Or(hn::Gt(load(packet.low[axis], i), near), hn::Lt(load(packet.high[axis], i), far)));
    }
  packet.one_brick = hn::AllFalse(floats, apart);
  packet.near_border = !hn::AllFalse(floats, border);
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
  for (int i = 0; i < packet.vectors * lanes; i += lanes)
    for (int axis = 0; axis < 3; ++axis) {
      const auto base = hn::Mul(hn::Load(ints, packet.brick[axis] + i), hn::Set(ints, TensorBrick::cells));
      const F low = hn::ConvertTo(floats, hn::Sub(hn::Set(ints, medium.first[axis]), base));
      const F high = hn::ConvertTo(floats, hn::Sub(hn::Set(ints, medium.last[axis]), base));
      store(low, packet.low[axis], i);
      store(high, packet.high[axis], i);
      store(hn::Max(hn::Sub(high, set(1)), low), packet.last[axis], i);
    }
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
    // The cell between the last two voxels is the last one, also for points on its far face.
    const F3 cell = floor(point(i)), last = load(packet.last, i);
    const auto away = [&](F to, F most)
                          HWY_ATTR { return hn::Floor(hn::Mul(hn::Min(to, most), set(1.0f / TensorBrick::cells))); };
    const F bricks[3] = {away(cell.x, last.x), away(cell.y, last.y), away(cell.z, last.z)};
    const Mask moves = hn::Or(hn::Ne(bricks[0], zero), hn::Or(hn::Ne(bricks[1], zero), hn::Ne(bricks[2], zero)));
    moved |= to_bits(moves, i);
    for (int axis = 0; axis < 3; ++axis) {
      for (PerRay* values : {&packet.p[axis], &packet.low[axis], &packet.high[axis], &packet.last[axis]})
        store(hn::NegMulAdd(bricks[axis], cells, load(*values, i)), *values, i);
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
