/// The last step of rays in the extent, which ends on a face of the extent or on a surface, and the path within a step.

/// The last step of rays: the length of the whole step, which is too long, its chord, and the axis of the face where
/// they leave; or `on_surface`, and the plane (SurfaceLanding).
struct alignas(64) FaceLanding {
  PerRay longest, chord[3], axis;
  PerRay normal[3], to_plane, part;
  bool on_surfaces;  // Whether any ray may end on a surface; otherwise the line above is not set.
};

/// The component of v along a ray's axis, or along the normal of its plane.
HWY_INLINE F across_plane(const FaceLanding& landing, const F3& v, int at) {
  const F axis = load(landing.axis, at);
  const F along = hn::IfThenElse(hn::Eq(axis, hn::Zero(floats)), v.x, hn::IfThenElse(hn::Eq(axis, set(1)), v.y, v.z));
  if (!landing.on_surfaces) return along;
  return hn::IfThenElse(hn::Eq(axis, set(on_surface)), dot(load(landing.normal, at), v), along);
}

/// Position, along an axis, of the extent's face through which rays along `chord` leave.
HWY_INLINE F face(const PacketMedium& medium, const Packet& packet, const FaceLanding& landing, int axis, int at) {
  const F margin = set(medium.margin[axis]);
  return hn::IfThenElse(hn::Gt(load(landing.chord[axis], at), hn::Zero(floats)),
                        hn::Add(load(packet.high[axis], at), margin), hn::Sub(load(packet.low[axis], at), margin));
}

/// Finds the face that the chord of the whole step meets, and the approximate length of a step that ends there.
static HWY_NOINLINE void aim_along_chord(const PacketMedium& medium, Packet& packet, FaceLanding& landing) {
  const F zero = hn::Zero(floats), one = set(1);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F longest = load(packet.time, i);
    store(longest, landing.longest, i);
    store(sub(load(packet.next.p, i), load(packet.now.p, i)), landing.chord, i);
    const auto part = [&](int axis) HWY_ATTR {
      const F along = load(landing.chord[axis], i);
      const F gap = hn::Sub(face(medium, packet, landing, axis, i), load(packet.now.p[axis], i));
      return hn::IfThenElse(hn::Gt(hn::Abs(along), zero), hn::Div(gap, along), set(1e30f));
    };
    const F x = part(0), y = part(1), z = part(2), nearest = hn::Min(hn::Min(x, y), z);
    store(hn::IfThenElse(hn::Eq(x, nearest), zero, hn::IfThenElse(hn::Eq(y, nearest), one, set(2))), landing.axis, i);
    store(hn::Mul(longest, hn::Min(hn::Max(nearest, zero), one)), packet.time, i);
    if (!landing.on_surfaces) continue;
    const F met = load(landing.part, i);
    const Mask meets = hn::Gt(met, zero);
    store(hn::IfThenElse(meets, set(on_surface), load(landing.axis, i)), landing.axis, i);
    store(hn::IfThenElse(meets, hn::Mul(longest, met), load(packet.time, i)), packet.time, i);
  }
}

/// The way from points of the steps to their faces or planes, across these.
HWY_INLINE F way_to_plane(const PacketMedium& medium, const Packet& packet, const FaceLanding& landing, const F3& from,
                          int at) {
  const auto on_face = [&](int k) HWY_ATTR { return face(medium, packet, landing, k, at); };
  const F way = across_plane(landing, sub({on_face(0), on_face(1), on_face(2)}, from), at);
  if (!landing.on_surfaces) return way;
  const F rest = hn::Sub(load(landing.to_plane, at), across_plane(landing, sub(from, load(packet.now.p, at)), at));
  return hn::IfThenElse(hn::Eq(load(landing.axis, at), set(on_surface)), rest, way);
}

/// Improves the lengths by the path between the ends of the whole step.
static HWY_NOINLINE void aim_along_path(const PacketMedium& medium, Packet& packet, const FaceLanding& landing) {
  const F one = set(1), two = set(2), three = set(3);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F longest = load(landing.longest, i);
    const auto across = [&](const F3& v) HWY_ATTR { return across_plane(landing, v, i); };
    const F way = across(sub(load(packet.next.p, i), load(packet.now.p, i)));
    const F gap = way_to_plane(medium, packet, landing, load(packet.now.p, i), i);
    const F a = hn::Mul(longest, across(load(packet.now.u, i))), b = hn::Mul(longest, across(load(packet.next.u, i)));
    // The path is a t + (3 way − 2 a − b) t² + (a + b − 2 way) t³.
    const F square = hn::Sub(hn::MulSub(three, way, hn::Mul(two, a)), b), cube = hn::NegMulAdd(two, way, hn::Add(a, b));
    F t = hn::Div(load(packet.time, i), longest);
    for (int n = 0; n < 3; ++n) {
      const F at = hn::Mul(t, hn::MulAdd(t, hn::MulAdd(t, cube, square), a));
      const F slope = hn::MulAdd(t, hn::MulAdd(hn::Mul(three, cube), t, hn::Mul(two, square)), a);
      const F change = hn::Div(hn::Sub(gap, at), slope);
      // Light nearly parallel to the face keeps the length by the chord.
      t = hn::IfThenElse(hn::Le(hn::Abs(change), one), hn::Min(hn::Max(hn::Add(t, change), hn::Zero(floats)), one), t);
    }
    store(hn::Mul(t, longest), packet.time, i);
  }
}

/// Moves the rays straight to their faces or planes, but not those nearly parallel to them.
static HWY_NOINLINE void move_to_faces(const PacketMedium& medium, Packet& packet, const FaceLanding& landing) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F3 to = load(packet.next.p, i), u = load(packet.next.u, i);
    const F gap = way_to_plane(medium, packet, landing, to, i);
    const F way = hn::Div(gap, across_plane(landing, u, i));
    F rest = hn::IfThenElseZero(hn::Le(hn::Abs(way), load(landing.longest, i)), way);
    if (landing.on_surfaces) rest = hn::Max(rest, hn::Neg(load(packet.time, i)));  // Not back behind the step.
    store(mul_add(rest, u, to), packet.next.p, i);
    store(hn::Add(load(packet.time, i), rest), packet.time, i);
  }
}

/// The path at the part t of the step (see path_weights), in index space.
HWY_INLINE F3 path_at(const Packet& packet, double t, int at) {
  const PathWeights weights = path_weights(t);
  const F time = load(packet.time, at);
  const auto along = [&](double weight, const F3& v)
                         HWY_ATTR { return mul(hn::Mul(set(static_cast<float>(weight)), time), v); };
  const auto at_end = [&](double weight, const F3& p) HWY_ATTR { return mul(set(static_cast<float>(weight)), p); };
  return add(add(at_end(weights.from, load(packet.now.p, at)), along(weights.from_direction, load(packet.now.u, at))),
             add(at_end(weights.to, load(packet.next.p, at)), along(weights.to_direction, load(packet.next.u, at))));
}

/// The lanes that turn on their way along an axis, or may do so, as bits: there the path's cubic polynomial may cross a
/// face more than once.
static HWY_NOINLINE std::uint32_t turning(const Packet& packet, int axis) {
  std::uint32_t result = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F way = hn::Sub(load(packet.next.p[axis], i), load(packet.now.p[axis], i)), time = load(packet.time, i);
    const auto is_steady = [&](const PerRay& slope) HWY_ATTR {  // Sufficient where it holds at both ends.
      const F part = hn::Div(hn::Mul(time, load(slope, i)), way);
      return hn::And(hn::Ge(part, hn::Zero(floats)), hn::Le(part, set(3)));
    };
    result |= to_bits(hn::Not(hn::And(is_steady(packet.now.u[axis]), is_steady(packet.next.u[axis]))), i);
  }
  return result;
}

/// The lanes whose points are outside the extent along an axis, as bits.
HWY_INLINE std::uint32_t outside(const PacketMedium& medium, const Packet& packet, const PerRay& points, int axis) {
  std::uint32_t result = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F x = load(points, i), margin = set(medium.margin[axis]);
    result |= to_bits(hn::Or(hn::Lt(hn::Add(x, margin), load(packet.low[axis], i)),
                             hn::Gt(hn::Sub(x, margin), load(packet.high[axis], i))),
                      i);
  }
  return result;
}

/// The lanes whose steps leave the extent between their ends, as bits. Lanes of `leave` that leave it only once, along
/// one axis, are not among them: the packet can find where they leave.
static HWY_NOINLINE std::uint32_t outside_between(const PacketMedium& medium, const Packet& packet,
                                                  std::uint32_t leave) {
  std::uint32_t any = 0, edges = 0;
  alignas(64) PerRay points[3][3];
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < packet.vectors * lanes; i += lanes) store(path_at(packet, 0.25 * (k + 1), i), points[k], i);
  for (int axis = 0; axis < 3; ++axis) {
    std::uint32_t along = outside(medium, packet, packet.next.p[axis], axis);
    for (const auto& point : points) along |= outside(medium, packet, point[axis], axis);
    edges |= along & (any | turning(packet, axis));
    any |= along;
  }
  return (any & ~leave) | edges;
}
