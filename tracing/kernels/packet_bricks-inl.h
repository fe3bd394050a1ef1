/// The bricks of a packet's lanes, and their sample points in these bricks.

/// The leaf of a lane, at any of its points. It is not compared with that of the lane before: where rays part, this
/// costs more than it saves.
HWY_INLINE LeafBrick leaf_of(const PacketMedium& medium, const Packet& packet, int lane) {
  const std::int32_t at[3] = {packet.brick[0][lane], packet.brick[1][lane], packet.brick[2][lane]};
  if (HWY_LIKELY(!medium.levels)) return {medium.brick(at)};
  return medium.leaf(at, {packet.first[0][lane], packet.first[1][lane], packet.first[2][lane]});
}

/// Whether a leaf holds the points `first` of all lanes of a vector.
HWY_INLINE bool holds_all(const Packet& packet, const LeafBrick& leaf, int at) {
  Mask all = hn::Eq(set(0), set(0));
  for (int axis = 0; axis < 3; ++axis) {
    const float low = leaf.first[static_cast<std::size_t>(axis)], high = low + TensorBrick::cells / leaf.scale;
    const F point = load(packet.first[axis], at);
    all = hn::And(all, hn::And(hn::Ge(point, set(low)), hn::Lt(point, set(high))));
  }
  return hn::AllTrue(floats, all);
}

/// Sets the places of a vector's leaves.
HWY_INLINE void set_places(Packet& packet, const LeafBrick& leaf, int at) {
  store({set(leaf.first[0]), set(leaf.first[1]), set(leaf.first[2])}, packet.first, at);
  store(set(leaf.scale), packet.scale, at);
}

/// Finds the leaves of some lanes, at the points `first`. `wanted` has one bit for each lane; other lanes of their
/// vectors keep their leaves.
HWY_INLINE void find_bricks(const PacketMedium& medium, Packet& packet, std::uint32_t wanted) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    std::uint32_t rest = bits_of_vector(wanted, i);
    if (rest == 0) continue;
    const auto same = [&](int axis) HWY_ATTR {
      return hn::Eq(hn::Load(ints, packet.brick[axis] + i), hn::Set(ints, packet.brick[axis][i]));
    };
    if (hn::AllTrue(ints, hn::And(same(0), hn::And(same(1), same(2))))) {
      const LeafBrick leaf = leaf_of(medium, packet, i);
      if (leaf.scale == 1 || holds_all(packet, leaf, i)) {
        std::fill_n(packet.bending + i, lanes, leaf.brick.bending);
        store(set(leaf.brick.strongest), packet.strongest, i);
        if (medium.levels) set_places(packet, leaf, i);
        continue;
      }
    }
    for (; rest != 0; rest &= rest - 1) {
      const int lane = i + static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest));
      const LeafBrick leaf = leaf_of(medium, packet, lane);
      packet.bending[lane] = leaf.brick.bending;
      packet.strongest[lane] = leaf.brick.strongest;
      if (!medium.levels) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) packet.first[axis][lane] = leaf.first[axis];
      packet.scale[lane] = leaf.scale;
    }
  }
}

/// Sets the values that depend on the strength of the lanes' bricks.
HWY_INLINE void find_reach(const PacketMedium& medium, Packet& packet) {
  const F most = set(1e30f), longest = set(medium.longest_kick);
  F greatest = hn::Zero(floats);
  packet.straight = packet.refined = false;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F strongest = load(packet.strongest, i);
    F reach = hn::Mul(hn::Mul(hn::Abs(load(packet.kick, i)), longest), strongest);
    if (medium.levels) {
      const F scale = load(packet.scale, i);
      packet.refined |= !hn::AllTrue(floats, hn::Eq(scale, set(1)));
      // Adaptive steps that reach into a finer leaf are repeated if they are too long for it.
      const F shorter = hn::Max(set(1), hn::Mul(set(static_cast<float>(1 / step_lengths::longest_into_finer)), scale));
      if (medium.adaptive) reach = hn::Div(reach, shorter);
    }
    store(reach, packet.reach, i);
    greatest = hn::Max(greatest, hn::IfThenElse(hn::Le(reach, most), reach, most));  // NaN counts as strong.
    packet.straight |= !hn::AllFalse(floats, hn::Eq(strongest, hn::Zero(floats)));
  }
  packet.max_reach = hn::GetLane(hn::MaxOfLanes(floats, greatest));
}

/// A point as seen from the lanes' leaves, in their voxels.
HWY_INLINE F3 in_leaf(const Packet& packet, const F3& point, int at) {
  const F scale = load(packet.scale, at);
  const F3 from = sub(point, load(packet.first, at));
  return {hn::Mul(scale, from.x), hn::Mul(scale, from.y), hn::Mul(scale, from.z)};
}

/// Finds the box of the voxels as seen from the lanes' leaves.
HWY_INLINE void find_extent_of_leaves(Packet& packet, int at) {
  const F3 low = in_leaf(packet, load(packet.low, at), at), high = in_leaf(packet, load(packet.high, at), at);
  const F one = set(1);
  store(low, packet.leaf_low, at);
  store(high, packet.leaf_high, at);
  store({hn::Max(hn::Sub(high.x, one), low.x), hn::Max(hn::Sub(high.y, one), low.y),
         hn::Max(hn::Sub(high.z, one), low.z)},
        packet.leaf_last, at);
}

/// Finds the box of the voxels, relative to the lanes' bricks.
HWY_INLINE void find_extent(const PacketMedium& medium, Packet& packet) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto base = hn::Mul(hn::Load(ints, packet.brick[axis] + i), hn::Set(ints, TensorBrick::cells));
      const F low = hn::ConvertTo(floats, hn::Sub(hn::Set(ints, medium.first[axis]), base));
      const F high = hn::ConvertTo(floats, hn::Sub(hn::Set(ints, medium.last[axis]), base));
      store(low, packet.low[axis], i);
      store(high, packet.high[axis], i);
      store(hn::Max(hn::Sub(high, set(1)), low), packet.last[axis], i);
    }
    if (packet.refined) find_extent_of_leaves(packet, i);
  }
}

/// Sets the values that depend on the lanes' bricks.
HWY_INLINE void summarize(const PacketMedium& medium, Packet& packet) {
  find_reach(medium, packet);
  find_extent(medium, packet);
  packet.near_surface = false;
  if (!medium.settings.geometry) return;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const auto is_far = [&](int axis) HWY_ATTR {
      const auto at = hn::Load(ints, packet.brick[axis] + i);
      return hn::Or(hn::Lt(at, hn::Set(ints, medium.first_near[axis])),
                    hn::Gt(at, hn::Set(ints, medium.last_near[axis])));
    };
    packet.near_surface |= !hn::AllTrue(ints, hn::Or(is_far(0), hn::Or(is_far(1), is_far(2))));
  }
}

/// Sets the values that depend on the rays of the lanes. Call it after lanes have been set.
static HWY_NOINLINE void begin(const PacketMedium& medium, Packet& packet) {
  find_bricks(medium, packet, ~0u >> (packet_rays - packet.vectors * lanes));
  summarize(medium, packet);
}

/// Moves the lanes whose point is outside their brick to the brick of the point, and to its leaf. `point(i)` gives the
/// points of the vector at lane i, relative to the lanes' bricks. `which` has the bits of lanes that may move.
template <class Point>
HWY_INLINE void move_to_bricks(const PacketMedium& medium, Packet& packet, std::uint32_t which, const Point& point) {
  const F zero = hn::Zero(floats), cells = set(TensorBrick::cells);
  std::uint32_t moved = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    if (bits_of_vector(which, i) == 0) continue;
    // The cell between the last two voxels is the last one, also for points on its far face.
    const F3 at = point(i), cell = minimum(floor(at), load(packet.last, i));
    const auto away = [](F to) HWY_ATTR { return hn::Floor(hn::Mul(to, set(1.0f / TensorBrick::cells))); };
    const F bricks[3] = {away(cell.x), away(cell.y), away(cell.z)};
    const Mask moves = hn::Or(hn::Ne(bricks[0], zero), hn::Or(hn::Ne(bricks[1], zero), hn::Ne(bricks[2], zero)));
    moved |= to_bits(moves, i);
    for (int axis = 0; axis < 3; ++axis) {
      store(hn::NegMulAdd(bricks[axis], cells, load(packet.now.p[axis], i)), packet.now.p[axis], i);
      std::int32_t* const brick = packet.brick[axis] + i;
      hn::Store(hn::Add(hn::Load(ints, brick), hn::ConvertTo(ints, bricks[axis])), ints, brick);
    }
    if (HWY_LIKELY(!medium.levels)) continue;
    alignas(64) PerRay points[3];
    for (int axis = 0; axis < 3; ++axis)
      store(hn::NegMulAdd(bricks[axis], cells, axis == 0 ? at.x : axis == 1 ? at.y : at.z), points[axis], i);
    for_lanes(bits_of_vector(which, i) << i, [&](int lane) {
      for (int axis = 0; axis < 3; ++axis) packet.first[axis][lane] = points[axis][lane];
    });
  }
  find_bricks(medium, packet, medium.levels ? which : moved);
  summarize(medium, packet);
}

/// Finds the sample points (`point_of(i)` gives those of the vector at lane i) and their cells. Points outside the
/// extent are moved to it: the tensor there is that of the nearest point.
/// @param moved  Bits of lanes; only their vectors are found again, and points outside their leaves count as on the
///               faces of the leaves. 0: all vectors.
/// @return bits of the lanes whose points are not within their leaves.
template <class Point>
HWY_INLINE std::uint32_t find_cells(Packet& packet, std::uint32_t moved, const Point& point_of) {
  const F last = set(CubicBrick::cells - 1), width = set(CubicBrick::width);
  std::uint32_t beyond = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    if (moved != 0 && bits_of_vector(moved, i) == 0) continue;
    F3 point = point_of(i);
    store(point, packet.sample, i);
    F3 near;
    if (HWY_LIKELY(!packet.refined)) {
      point = clamp(point, load(packet.low, i), load(packet.high, i));
      near = clamp(floor(point), load(packet.low, i), load(packet.last, i));
    } else {
      point = clamp(in_leaf(packet, point, i), load(packet.leaf_low, i), load(packet.leaf_high, i));
      near = clamp(floor(point), load(packet.leaf_low, i), load(packet.leaf_last, i));
    }
    // As unsigned integers, negative floats are the greatest.
    const auto greatest =
        hn::Max(hn::BitCast(bits, near.x), hn::Max(hn::BitCast(bits, near.y), hn::BitCast(bits, near.z)));
    beyond |= to_bits(hn::RebindMask(floats, hn::Gt(greatest, hn::BitCast(bits, last))), i);
    if (moved != 0) near = clamp(near, zeros(), {last, last, last});
    store(sub(point, near), packet.fraction, i);
    store(hn::MulAdd(hn::MulAdd(near.x, width, near.y), width, near.z), packet.voxel, i);
  }
  return beyond;
}

/// Finds the sample points, and moves lanes to the leaves of these points.
template <class Point>
HWY_INLINE void locate(const PacketMedium& medium, Packet& packet, const Point& point_of) {
  const std::uint32_t beyond = find_cells(packet, 0, point_of);
  if (HWY_LIKELY(beyond == 0)) return;
  move_to_bricks(medium, packet, beyond, [&](int i) HWY_ATTR {
    return clamp(load(packet.sample, i), load(packet.low, i), load(packet.high, i));
  });
  // The remaining points are outside the extent, or rounding put them on a face.
  find_cells(packet, beyond, point_of);
}
