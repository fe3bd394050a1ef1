/// @file integrators/packet_bricks-inl.h
/// The bricks that a packet's lanes are in. A part of packet_kernel.cpp.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_BRICKS_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_BRICKS_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_BRICKS_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_BRICKS_TOGGLE
#endif

#include <hwy/highway.h>

#include "integrators/packet_cells-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

/// Finds the bricks of some lanes, given as bits.
HWY_INLINE void find_bricks(const Medium& medium, Packet& packet, std::uint32_t wanted) {
  const auto x = hn::Load(ints, packet.brick[0]), y = hn::Load(ints, packet.brick[1]),
             z = hn::Load(ints, packet.brick[2]);
  while (wanted != 0) {
    const auto first = hwy::Num0BitsBelowLS1Bit_Nonzero32(wanted);
    const std::int32_t at[3] = {packet.brick[0][first], packet.brick[1][first], packet.brick[2][first]};
    const TensorBrick brick = medium.brick(at);
    const auto same = hn::And(hn::Eq(x, hn::Set(ints, at[0])),
                              hn::And(hn::Eq(y, hn::Set(ints, at[1])), hn::Eq(z, hn::Set(ints, at[2]))));
    const std::uint32_t found = to_bits(hn::RebindMask(floats, same)) & wanted;
    for (int lane = 0; lane < lanes; ++lane) {
      if (!(found >> lane & 1)) continue;
      packet.bending[lane] = brick.bending;
      packet.strongest[lane] = brick.strongest;
    }
    wanted &= ~found;
  }
}

/// Sets what follows from the lanes' bricks.
template <bool uniform>
HWY_INLINE void summarize(const Medium& medium, Packet& packet) {
  const F strongest = hn::Load(floats, packet.strongest), most = set(1e30f);
  const float longest = medium.longest_step * (uniform ? 1.0f : medium.longest_voxel);
  const F reach = hn::Mul(hn::Mul(hn::Abs(hn::Load(floats, packet.kick)), set(longest)), strongest);
  hn::Store(reach, floats, packet.reach);
  packet.greatest_reach =
      hn::AllTrue(floats, hn::Le(reach, most)) ? hn::GetLane(hn::MaxOfLanes(floats, reach)) : 1e30f;  // NaN is strong.
  packet.straight = !hn::AllFalse(floats, hn::Eq(strongest, hn::Zero(floats)));
  if (packet.greatest_reach <= strongest_kick)
    hn::Store(hn::Zero(floats), floats, packet.bending_rate);  // Steps stay long.

  // A step may begin a little outside of its brick.
  const F near = set(-medium.longest_step - 1), far = set(TensorBrick::cells + medium.longest_step + 1);
  Mask border = hn::Gt(hn::Load(floats, packet.low[0]), near), apart = hn::Lt(near, near);
  for (int axis = 0; axis < 3; ++axis) {
    const auto brick = hn::Load(ints, packet.brick[axis]);
    apart = hn::Or(apart, hn::RebindMask(floats, hn::Ne(brick, hn::Set(ints, packet.brick[axis][0]))));
    border = hn::Or(border, hn::Or(hn::Gt(hn::Load(floats, packet.low[axis]), near),
                                   hn::Lt(hn::Load(floats, packet.high[axis]), far)));
  }
  packet.one_brick = hn::AllFalse(floats, apart);
  packet.near_border = !hn::AllFalse(floats, border);
  if (!medium.settings.meets_surface) return;
  packet.near_surface = false;
  for (int lane = 0; lane < lanes; ++lane) {
    const std::int32_t at[3] = {packet.brick[0][lane], packet.brick[1][lane], packet.brick[2][lane]};
    packet.near_surface |= medium.near_surface(at);
  }
}

/// After lanes have been set: what follows from their rays.
template <bool uniform>
void begin(const Medium& medium, Packet& packet) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto base = hn::Mul(hn::Load(ints, packet.brick[axis]), hn::Set(ints, TensorBrick::cells));
    const F low = hn::ConvertTo(floats, hn::Sub(hn::Set(ints, medium.first[axis]), base));
    const F high = hn::ConvertTo(floats, hn::Sub(hn::Set(ints, medium.last[axis]), base));
    hn::Store(low, floats, packet.low[axis]);
    hn::Store(high, floats, packet.high[axis]);
    hn::Store(hn::Max(hn::Sub(high, set(1)), low), floats, packet.last[axis]);
  }
  find_bricks(medium, packet, (1u << lanes) - 1);
  summarize<uniform>(medium, packet);
}

/// Takes the lanes whose point has left their brick to the point's.
template <bool uniform>
HWY_NOINLINE void move_to_bricks(const Medium& medium, Packet& packet, const F3& point) {
  const F axes[3] = {point.x, point.y, point.z};
  const F zero = hn::Zero(floats), cells = set(TensorBrick::cells);
  Mask moved = hn::Lt(zero, zero);
  for (int axis = 0; axis < 3; ++axis) {
    // The cell between the last two voxels is the last one, also for points on its far face.
    const F cell = hn::Min(hn::Floor(axes[axis]), hn::Load(floats, packet.last[axis]));
    const F bricks = hn::Floor(hn::Mul(cell, set(1.0f / TensorBrick::cells)));
    moved = hn::Or(moved, hn::Ne(bricks, zero));
    for (float* values : {packet.p[axis], packet.low[axis], packet.high[axis], packet.last[axis]})
      hn::Store(hn::NegMulAdd(bricks, cells, hn::Load(floats, values)), floats, values);
    hn::Store(hn::Add(hn::Load(ints, packet.brick[axis]), hn::ConvertTo(ints, bricks)), ints, packet.brick[axis]);
  }
  find_bricks(medium, packet, to_bits(moved));
  summarize<uniform>(medium, packet);
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
