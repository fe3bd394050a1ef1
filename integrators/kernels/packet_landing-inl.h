/// @file integrators/kernels/packet_landing-inl.h
/// The last step of rays in the extent, which ends on a face of the extent. A part of packet_kernel-inl.h.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_LANDING_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_LANDING_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_LANDING_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_LANDING_TOGGLE
#endif

#include <hwy/highway.h>

#include "integrators/kernels/packet_steps-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

/// The last step of rays: the length of the whole step, which is too long, its chord, and the axis of the face where
/// they leave.
struct alignas(64) FaceLanding {
  PerRay longest, chord[3], axis;
};

/// Position, along an axis, of the extent's face through which rays along `chord` leave.
HWY_INLINE F face(const PacketMedium& medium, const Packet& packet, const FaceLanding& landing, int axis, int at) {
  const F margin = set(medium.margin[axis]);
  return hn::IfThenElse(hn::Gt(load(landing.chord[axis], at), hn::Zero(floats)),
                        hn::Add(load(packet.high[axis], at), margin), hn::Sub(load(packet.low[axis], at), margin));
}

/// Finds the face that the chord of the whole step meets, and the approximate length of a step that ends there.
static HWY_NOINLINE void aim(const PacketMedium& medium, Packet& packet, FaceLanding& landing) {
  const F zero = hn::Zero(floats), one = set(1);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F longest = load(packet.time, i);
    store(longest, landing.longest, i);
    store(sub(load(packet.p_next, i), load(packet.p, i)), landing.chord, i);
    const auto part = [&](int axis) HWY_ATTR {
      const F along = load(landing.chord[axis], i);
      const F gap = hn::Sub(face(medium, packet, landing, axis, i), load(packet.p[axis], i));
      return hn::IfThenElse(hn::Gt(hn::Abs(along), zero), hn::Div(gap, along), set(1e30f));
    };
    const F x = part(0), y = part(1), z = part(2), nearest = hn::Min(hn::Min(x, y), z);
    store(hn::IfThenElse(hn::Eq(x, nearest), zero, hn::IfThenElse(hn::Eq(y, nearest), one, set(2))), landing.axis, i);
    store(hn::Mul(longest, hn::Min(hn::Max(nearest, zero), one)), packet.time, i);
  }
}

/// Improves the lengths by the path between the ends of the whole step.
template <bool uniform>
HWY_NOINLINE void aim_along_path(const PacketMedium& medium, Packet& packet, const FaceLanding& landing) {
  const F one = set(1), two = set(2), three = set(3);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F longest = load(landing.longest, i), axis = load(landing.axis, i);
    const auto of_axis = [&](const F3& v) HWY_ATTR {
      return hn::IfThenElse(hn::Eq(axis, hn::Zero(floats)), v.x, hn::IfThenElse(hn::Eq(axis, one), v.y, v.z));
    };
    const auto on_face = [&](int k) HWY_ATTR { return face(medium, packet, landing, k, i); };
    const F3 v = uniform ? load(packet.v, i) : load(packet.u, i);
    const F3 v_next = uniform ? load(packet.v_next, i) : load(packet.u_next, i);
    const F from = of_axis(load(packet.p, i)), way = hn::Sub(of_axis(load(packet.p_next, i)), from);
    const F gap = hn::Sub(of_axis({on_face(0), on_face(1), on_face(2)}), from);
    const F a = hn::Mul(longest, of_axis(v)), b = hn::Mul(longest, of_axis(v_next));
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

/// How much longer, to first order, steps must be to end on the faces; 0 for light nearly parallel to its face.
template <bool uniform>
HWY_INLINE F rest_of_way(const PacketMedium& medium, const Packet& packet, const FaceLanding& landing, int at) {
  const F zero = hn::Zero(floats), axis = load(landing.axis, at);
  const auto of_axis = [&](F a, F b, F c) HWY_ATTR {
    return hn::IfThenElse(hn::Eq(axis, zero), a, hn::IfThenElse(hn::Eq(axis, set(1)), b, c));
  };
  const auto on_face = [&](int k) HWY_ATTR { return face(medium, packet, landing, k, at); };
  const F3 to = load(packet.p_next, at), u = uniform ? load(packet.v_next, at) : load(packet.u_next, at);
  const F gap = hn::Sub(of_axis(on_face(0), on_face(1), on_face(2)), of_axis(to.x, to.y, to.z));
  const F rest = hn::Div(gap, of_axis(u.x, u.y, u.z));
  return hn::IfThenElseZero(hn::Le(hn::Abs(rest), load(landing.longest, at)), rest);
}

/// A step of Newton's method for the lengths of the steps.
template <bool uniform>
HWY_NOINLINE void improve(const PacketMedium& medium, Packet& packet, const FaceLanding& landing) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F time = hn::Add(load(packet.time, i), rest_of_way<uniform>(medium, packet, landing, i));
    store(hn::Min(hn::Max(time, hn::Zero(floats)), load(landing.longest, i)), packet.time, i);
  }
}

/// Moves the rays straight to the faces.
template <bool uniform>
HWY_NOINLINE void move_to_faces(const PacketMedium& medium, Packet& packet, const FaceLanding& landing) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F rest = rest_of_way<uniform>(medium, packet, landing, i);
    const F3 u = uniform ? load(packet.v_next, i) : load(packet.u_next, i);
    store(mul_add(rest, u, load(packet.p_next, i)), packet.p_next, i);
    store(hn::Add(load(packet.time, i), rest), packet.time, i);
  }
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
