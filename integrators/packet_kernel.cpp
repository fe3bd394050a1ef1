#include "integrators/packet_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "integrators/packet_medium.h"

// Compiled once for each instruction set, of which the processor's best is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "integrators/packet_kernel.cpp"  // NOLINT
// Vectors are members of structs here, which those whose size is not known when compiling cannot be.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// Must come after it:
#include <hwy/highway.h>

#include "integrators/packet_bending-inl.h"
#include "integrators/packet_bricks-inl.h"
#include "integrators/packet_cells-inl.h"

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

/// The kernel, for voxels that are cubes along the axes (`uniform`) or any others, and for rays with or without
/// differentials.
template <bool uniform, bool differentials>
class Kernel {
 public:
  Kernel(const Medium& medium, KernelRays& batch) : medium_(medium), rays_(batch.rays), batch_(batch) {}

  std::uint64_t run();

 private:
  static constexpr int in_flight = 4;  // Packets that are stepped in turn: the processor works on several at once.

  bool fill(Packet& packet);
  void enter(Packet& packet, int lane);
  void repeat(Packet& packet, int lane, int of);
  void prefetch(const Packet& packet, const F3& point);
  void locate(Packet& packet, F time);
  void interpolate(Packet& packet);
  void bend_differentials(Packet& packet, const Tensor& T, const F3& v, F factor, F time);
  F3 index_direction(const F3& v) const;
  void leave_straight_bricks(Packet& packet);
  F step_time(Packet& packet, const F3& u);
  F3 take_step(Packet& packet, F3& v, F3& u);
  void step(Packet& packet);
  std::uint32_t outside(const Packet& packet, const F3& to) const;
  std::uint32_t stopped(const Packet& packet, const F3& to, const F3& v) const;
  std::uint32_t spent(const Packet& packet) const;
  void locate_on_extent(Packet& packet);
  void take_out(Packet& packet, std::uint32_t stop, std::uint32_t leave);
  void repeat_one_alive(Packet& packet);
  void keep_points(const Packet& packet);
  static auto direction(const Packet& packet) -> const float (&)[3][most_lanes] {
    return uniform ? packet.v : packet.u;
  }
  float to_world() const { return uniform ? medium_.voxel : 1.0f; }  // Of what u is per.
  void land(Packet& packet);

  const Medium& medium_;
  const bool may_stop_ = std::isfinite(medium_.settings.max_length);  // Within the field, before the last step.
  std::vector<KernelRay>& rays_;
  KernelRays& batch_;
  std::size_t next_ = 0;  // The first ray that no packet has held yet.
  std::uint64_t samples_ = 0;
  Packet packets_[in_flight];
  Packet leaving_[in_flight];  // Rays of these that leave the extent, as before their last step.
};

/// Brings a ray into a lane.
template <bool uniform, bool differentials>
void Kernel<uniform, differentials>::enter(Packet& packet, int lane) {
  const KernelRay& ray = rays_[packet.ray[lane]];
  for (int axis = 0; axis < 3; ++axis) {
    packet.p[axis][lane] = ray.position[axis];
    packet.v[axis][lane] = ray.direction[axis];
    packet.brick[axis][lane] = ray.brick[axis];
    if constexpr (differentials)
      for (int i = 0; i < 2; ++i) {
        packet.dp[i][axis][lane] = batch_.differentials[packet.ray[lane]].position[i][axis];
        packet.dv[i][axis][lane] = batch_.differentials[packet.ray[lane]].direction[i][axis];
      }
  }
  packet.kick[lane] = uniform ? ray.flexibility * medium_.voxel : ray.flexibility;
  packet.bending_rate[lane] = std::fabs(packet.kick[lane]) * ray.norm;
  packet.length[lane] = 0;
}

/// Lets a lane repeat what another does.
template <bool uniform, bool differentials>
void Kernel<uniform, differentials>::repeat(Packet& packet, int lane, int of) {
  for (int axis = 0; axis < 3; ++axis) {
    packet.p[axis][lane] = packet.p[axis][of];
    packet.v[axis][lane] = packet.v[axis][of];
    packet.u[axis][lane] = packet.u[axis][of];
    packet.brick[axis][lane] = packet.brick[axis][of];
    if constexpr (differentials)
      for (int i = 0; i < 2; ++i) {
        packet.dp[i][axis][lane] = packet.dp[i][axis][of];
        packet.dv[i][axis][lane] = packet.dv[i][axis][of];
      }
  }
  packet.kick[lane] = packet.kick[of];
  packet.length[lane] = packet.length[of];
  packet.bending_rate[lane] = packet.bending_rate[of];
  packet.time[lane] = packet.time[of];
  packet.ray[lane] = packet.ray[of];
}

template <bool uniform, bool differentials>
bool Kernel<uniform, differentials>::fill(Packet& packet) {
  if (next_ == rays_.size()) return false;
  packet.alive = 0;
  packet.clamps = medium_.flat;
  packet.steps = 0;
  packet.most_steps = medium_.settings.max_steps;
  for (int lane = 0; lane < lanes; ++lane) {
    if (next_ == rays_.size()) {
      repeat(packet, lane, 0);
      continue;
    }
    packet.ray[lane] = static_cast<std::int32_t>(next_++);
    enter(packet, lane);
    packet.alive |= 1u << lane;
    packet.most_steps = std::min(packet.most_steps, medium_.settings.max_steps - rays_[packet.ray[lane]].steps);
  }
  if constexpr (!uniform) store(index_direction(load(packet.v)), packet.u);
  begin<uniform>(medium_, packet);
  return true;
}

template <bool uniform, bool differentials>
HWY_INLINE F3 Kernel<uniform, differentials>::index_direction(const F3& v) const {
  if constexpr (uniform) return v;
  const auto& m = medium_.to_index;
  const auto row = [&](int i) HWY_ATTR {
    return hn::MulAdd(set(m[i][0]), v.x, hn::MulAdd(set(m[i][1]), v.y, hn::Mul(set(m[i][2]), v.z)));
  };
  return {row(0), row(1), row(2)};
}

/// Asks for the memory of the cells where a packet will be after two long steps, as far as they are in its bricks. Only
/// where its lanes are apart: the cells of others are mostly at hand, and it would cost them a tenth.
template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::prefetch(const Packet& packet, const F3& point) {
  const F3 ahead = add(point, load(direction(packet)));
  const F zero = hn::Zero(floats), last = set(TensorBrick::cells - 0.5f), width = set(TensorBrick::width);
  const F3 cell = clamp(ahead, F3{zero, zero, zero}, F3{last, last, last});
  const F voxel = hn::MulAdd(hn::MulAdd(hn::Floor(cell.x), width, hn::Floor(cell.y)), width, hn::Floor(cell.z));
  alignas(64) std::int32_t voxels[most_lanes];
  hn::Store(hn::ConvertTo(ints, voxel), ints, voxels);
  for (int lane = 0; lane < lanes; ++lane)
    prefetch_cell(packet.bending[lane] + voxels[lane] * TensorBrick::bending_floats);
}

/// The first part of a step: to its middle, and what is needed to interpolate there. Takes lanes to the bricks of these
/// points. Steps have parts so that the processor works on the same part of several packets at once: each is a chain of
/// operations that wait for one another, and a whole step is longer than what a processor looks ahead.
template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::locate(Packet& packet, F time) {
  const F3 offset = mul(hn::Mul(set(0.5f), time), load(direction(packet)));
  F3 point, near;
  for (bool again = false;; again = true) {
    point = add(load(packet.p), offset);
    if (HWY_UNLIKELY(packet.clamps)) point = clamp(point, load(packet.low), load(packet.high));
    near = {hn::Floor(point.x), hn::Floor(point.y), hn::Floor(point.z)};
    if (HWY_UNLIKELY(packet.clamps)) near = clamp(near, load(packet.low), load(packet.last));
    // As unsigned integers, negative floats are the greatest.
    const auto greatest =
        hn::Max(hn::Max(hn::BitCast(bits, near.x), hn::BitCast(bits, near.y)), hn::BitCast(bits, near.z));
    const auto outside_brick = hn::Gt(greatest, hn::BitCast(bits, set(TensorBrick::cells - 1)));
    if (HWY_LIKELY(hn::AllFalse(bits, outside_brick))) break;
    if (again) {  // Beyond the extent, or on the face that rounding took it to.
      const F zero = hn::Zero(floats), last = set(TensorBrick::cells - 1);
      near = clamp(near, F3{zero, zero, zero}, F3{last, last, last});
      break;
    }
    move_to_bricks<uniform>(medium_, packet, point);
  }
  hn::Store(time, floats, packet.time);
  store(add(load(packet.p), offset), packet.middle);
  if constexpr (differentials)
    for (int i = 0; i < 2; ++i)
      store(mul_add(hn::Mul(set(0.5f), time), index_direction(load(packet.dv[i])), load(packet.dp[i])),
            packet.dmiddle[i]);
  store({hn::Sub(point.x, near.x), hn::Sub(point.y, near.y), hn::Sub(point.z, near.z)}, packet.fraction);
  const F width = set(TensorBrick::width);
  const F voxel = hn::MulAdd(hn::MulAdd(near.x, width, near.y), width, near.z);
  const float first = hn::GetLane(voxel);
  packet.one_cell = packet.one_brick && hn::AllTrue(floats, hn::Eq(voxel, set(first)));
  if (HWY_LIKELY(packet.one_cell))
    return make_polynomial(packet.bending[0] + static_cast<int>(first) * TensorBrick::bending_floats,
                           packet.polynomial);
  prefetch(packet, point);
  alignas(64) std::int32_t voxels[most_lanes];
  hn::Store(hn::ConvertTo(ints, voxel), ints, voxels);
  sample_own_cells<differentials>(packet, voxels);
}

/// The second part: the tensor there.
template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::interpolate(Packet& packet) {
  if (HWY_UNLIKELY(!packet.one_cell)) {
    transpose(packet.components, packet.tensor);
    if constexpr (differentials)
      for (int axis = 0; axis < 3; ++axis) transpose(packet.slope_components[axis], packet.slopes[axis]);
    return;
  }
  const F3 f = load(packet.fraction);
  for (int i = 0; i < 8; ++i) {
    if constexpr (differentials) {
      const Slopes<F> at = polynomial_slopes(packet.polynomial, i, f);
      hn::Store(at.value, floats, packet.tensor[i]);
      hn::Store(at.x, floats, packet.slopes[0][i]);
      hn::Store(at.y, floats, packet.slopes[1][i]);
      hn::Store(at.z, floats, packet.slopes[2][i]);
    } else {
      hn::Store(evaluate_polynomial(packet.polynomial, i, f), floats, packet.tensor[i]);
    }
  }
}

/// The last step of lanes in bricks where nothing bends light ended a little behind them: takes these lanes to the
/// bricks where they are now. (Others are taken there by their steps' middles, whatever their neighbours do.)
template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::leave_straight_bricks(Packet& packet) {
  const F zero = hn::Zero(floats), end = set(TensorBrick::cells);
  const F3 p = load(packet.p);
  const auto beyond = [&](F x) HWY_ATTR { return hn::Or(hn::Lt(x, zero), hn::Ge(x, end)); };
  const Mask moves =
      hn::And(hn::Eq(hn::Load(floats, packet.strongest), zero), hn::Or(beyond(p.x), hn::Or(beyond(p.y), beyond(p.z))));
  if (!hn::AllFalse(floats, moves))
    move_to_bricks<uniform>(medium_, packet,
                            select(moves, clamp(p, load(packet.low), load(packet.high)), {zero, zero, zero}));
}

/// How long the next step is, in the units that u is per: voxels, or, if voxels are not uniform, world units.
template <bool uniform, bool differentials>
HWY_INLINE F Kernel<uniform, differentials>::step_time(Packet& packet, const F3& u) {
  const F voxel = uniform ? set(1) : hn::Div(set(1), hn::Sqrt(dot(u, u)));
  const bool automatic = medium_.settings.step == 0;
  F steps = set(medium_.longest_step);
  if (HWY_UNLIKELY(automatic && !(packet.greatest_reach <= strongest_kick))) {
    const F kick = hn::Mul(hn::Load(floats, packet.bending_rate), voxel);
    const F shorter = hn::Max(hn::Div(set(strongest_kick), kick), set(shortest_automatic_step));
    steps = hn::IfThenElse(hn::Gt(hn::Mul(kick, set(longest_automatic_step)), set(strongest_kick)), shorter, steps);
  }
  F time = uniform ? steps : hn::Mul(steps, voxel);
  if (HWY_UNLIKELY(packet.straight)) {
    leave_straight_bricks(packet);
    // Out of the brick where nothing bends light, and a little further, so that rounding does not keep it there.
    const F3 p = load(packet.p);
    const F zero = hn::Zero(floats), end = set(TensorBrick::cells);
    const auto way = [&](F x, F along) HWY_ATTR {
      const F to = hn::Sub(hn::IfThenElse(hn::Gt(along, zero), end, zero), x);
      return hn::IfThenElse(hn::Eq(along, zero), set(1e30f), hn::Div(to, along));
    };
    const F out = hn::Min(hn::Min(way(p.x, u.x), way(p.y, u.y)), way(p.z, u.z));
    const auto within = [&](F x) HWY_ATTR { return hn::And(hn::Ge(x, zero), hn::Le(x, end)); };
    const Mask crosses = hn::And(hn::And(within(p.x), hn::And(within(p.y), within(p.z))),
                                 hn::And(hn::Eq(hn::Load(floats, packet.strongest), zero), hn::Lt(out, set(1e29f))));
    time = hn::IfThenElse(crosses, hn::MulAdd(set(past_straight_brick), voxel, out), time);
  }
  return time;
}

/// The derivatives of exp(factor · T) V, normalised, along two parameters, and those of the positions at the end of the
/// step: of the method's own steps. One term more than without, as the derivative of a series has one less.
template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::bend_differentials(Packet& packet, const Tensor& T, const F3& v,
                                                                   F factor, F time) {
  const F size = hn::Load(floats, packet.size);
  for (int i = 0; i < 2; ++i) {
    F3 along = load(packet.dmiddle[i]);
    if (medium_.flat)  // The tensor is the same across an axis of a single voxel.
      along = F3{hn::Mul(along.x, set(medium_.slope[0])), hn::Mul(along.y, set(medium_.slope[1])),
                 hn::Mul(along.z, set(medium_.slope[2]))};
    Tensor dT;
    for (int c = 0; c < 8; ++c)
      dT.c[c] = hn::MulAdd(along.x, hn::Load(floats, packet.slopes[0][c]),
                           hn::MulAdd(along.y, hn::Load(floats, packet.slopes[1][c]),
                                      hn::Mul(along.z, hn::Load(floats, packet.slopes[2][c]))));
    F3 term = v, sum = v, dterm = load(packet.dv[i]), dsum = dterm;
    for (int n = 1; n <= most_terms; ++n) {
      const Mask needed = hn::Gt(size, set(n < 4 ? -1.0f : series_reach[n - 4]));
      if (hn::AllFalse(floats, needed)) break;
      const F part = hn::Mul(set(1.0f / static_cast<float>(n)), factor);
      dterm = mul(part, add(apply(T, dterm), apply(dT, term)));
      term = mul(part, apply(T, term));
      const F3 zero{hn::Zero(floats), hn::Zero(floats), hn::Zero(floats)};
      sum = add(sum, select(needed, term, zero));
      dsum = add(dsum, select(needed, dterm, zero));
    }
    const F inverse = hn::Div(set(1), hn::Sqrt(dot(sum, sum)));
    const F3 unit = mul(inverse, sum), change = mul(inverse, dsum);
    const F3 dv = mul_add(hn::Neg(dot(unit, change)), unit, change);
    store(dv, packet.dv_next[i]);
    store(mul_add(hn::Mul(set(0.5f), time), index_direction(dv), load(packet.dmiddle[i])), packet.dp_next[i]);
  }
}

/// The third part: bends, and on from the middle. Sets the directions at the end. @return the positions.
template <bool uniform, bool differentials>
HWY_INLINE F3 Kernel<uniform, differentials>::take_step(Packet& packet, F3& v, F3& u) {
  const F time = hn::Load(floats, packet.time);
  Tensor T;
  for (int i = 0; i < 8; ++i) T.c[i] = hn::Load(floats, packet.tensor[i]);
  const F factor = hn::Mul(time, hn::Load(floats, packet.kick));
  v = bend<differentials>(packet, T, load(packet.v), factor);
  if constexpr (differentials) bend_differentials(packet, T, load(packet.v), factor, time);
  u = index_direction(v);
  return mul_add(hn::Mul(set(0.5f), time), u, load(packet.middle));
}

/// The lanes that leave the extent, as bits.
template <bool uniform, bool differentials>
HWY_INLINE std::uint32_t Kernel<uniform, differentials>::outside(const Packet& packet, const F3& to) const {
  const auto of_axis = [&](F x, int axis) HWY_ATTR {
    const F margin = set(medium_.margin[axis]);
    return hn::Or(hn::Lt(hn::Add(x, margin), hn::Load(floats, packet.low[axis])),
                  hn::Gt(hn::Sub(x, margin), hn::Load(floats, packet.high[axis])));
  };
  return to_bits(hn::Or(hn::Or(of_axis(to.x, 0), of_axis(to.y, 1)), of_axis(to.z, 2)));
}

/// The lanes that cannot take this step, as bits.
template <bool uniform, bool differentials>
HWY_NOINLINE std::uint32_t Kernel<uniform, differentials>::stopped(const Packet& packet, const F3& to,
                                                                   const F3& v) const {
  const F unit = dot(v, v);
  std::uint32_t stop = to_bits(hn::Not(hn::Gt(unit, set(0.5f))));  // No direction to go in.
  alignas(64) float before[most_lanes];                            // Of the way to the field.
  for (int lane = 0; lane < lanes; ++lane) before[lane] = static_cast<float>(rays_[packet.ray[lane]].length);
  const F way = hn::Add(hn::Load(floats, packet.length), hn::Load(floats, packet.time));
  const F length = hn::MulAdd(way, set(to_world()), hn::Load(floats, before));
  stop |= to_bits(hn::Ge(length, set(medium_.settings.max_length)));
  if (!packet.near_surface) return stop;
  alignas(64) float ends[3][most_lanes];
  store(to, ends);
  for (int lane = 0; lane < lanes; ++lane) {
    if (!(packet.alive >> lane & 1)) continue;
    double from[3], until[3];
    for (int axis = 0; axis < 3; ++axis) {
      const double base = double{TensorBrick::cells} * packet.brick[axis][lane];
      from[axis] = base + packet.p[axis][lane];
      until[axis] = base + ends[axis][lane];
    }
    if (medium_.meets_surface(from, until)) stop |= 1u << lane;
  }
  return stop;
}

/// The lanes that may take no further step, as bits: those of light that has come through a cut have taken more.
template <bool uniform, bool differentials>
HWY_NOINLINE std::uint32_t Kernel<uniform, differentials>::spent(const Packet& packet) const {
  std::uint32_t result = 0;
  for (int lane = 0; lane < lanes; ++lane)
    if (rays_[packet.ray[lane]].steps + packet.steps >= medium_.settings.max_steps) result |= 1u << lane;
  return result;
}

/// Takes the middles of steps that lie beyond the extent to the nearest points on it, where the tensor is that of the
/// outermost voxels. Light may turn back into the extent from there.
template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::locate_on_extent(Packet& packet) {
  packet.clamps = true;
  locate(packet, hn::Load(floats, packet.time));
  interpolate(packet);
  packet.clamps = medium_.flat;
}

/// Hands the rays of some lanes on, as they are before the step.
template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::take_out(Packet& packet, std::uint32_t stop, std::uint32_t leave) {
  Packet& leaving = leaving_[&packet - packets_];
  for (int lane = 0; lane < lanes; ++lane) {
    if (!((stop | leave) >> lane & 1)) continue;
    KernelRay& ray = rays_[packet.ray[lane]];
    for (int axis = 0; axis < 3; ++axis) {
      ray.brick[axis] = packet.brick[axis][lane];
      ray.position[axis] = packet.p[axis][lane];
      ray.direction[axis] = packet.v[axis][lane];
      if constexpr (differentials)
        for (int i = 0; i < 2; ++i) {
          batch_.differentials[packet.ray[lane]].position[i][axis] = packet.dp[i][axis][lane];
          batch_.differentials[packet.ray[lane]].direction[i][axis] = packet.dv[i][axis][lane];
        }
    }
    ray.length += double{packet.length[lane]} * to_world();
    ray.step = packet.time[lane] * to_world();
    ray.steps += packet.steps;
    packet.alive &= ~(1u << lane);
    if (!(leave >> lane & 1)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      leaving.p[axis][lane] = packet.p[axis][lane];
      leaving.v[axis][lane] = packet.v[axis][lane];
      leaving.u[axis][lane] = packet.u[axis][lane];
      leaving.brick[axis][lane] = packet.brick[axis][lane];
    }
    leaving.kick[lane] = packet.kick[lane];
    leaving.time[lane] = packet.time[lane];
    leaving.ray[lane] = packet.ray[lane];
    leaving.alive |= 1u << lane;
  }
}

template <bool uniform, bool differentials>
void Kernel<uniform, differentials>::repeat_one_alive(Packet& packet) {
  const int of = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(packet.alive));
  for (int lane = 0; lane < lanes; ++lane)
    if (!(packet.alive >> lane & 1)) repeat(packet, lane, of);
  begin<uniform>(medium_, packet);
}

template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::keep_points(const Packet& packet) {
  for (int lane = 0; lane < lanes; ++lane) {
    if (!(packet.alive >> lane & 1)) continue;
    const KernelRay& ray = rays_[packet.ray[lane]];
    KernelPoint point;
    for (int axis = 0; axis < 3; ++axis) {
      point.brick[axis] = packet.brick[axis][lane];
      point.position[axis] = packet.p[axis][lane];
      point.direction[axis] = packet.v[axis][lane];
    }
    point.length = ray.length + double{packet.length[lane]} * to_world();
    batch_.points[packet.ray[lane]].push_back(point);
  }
}

template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::step(Packet& packet) {
  if (HWY_UNLIKELY(packet.near_border && (outside(packet, load(packet.middle)) & packet.alive) != 0))
    locate_on_extent(packet);
  F3 v, u;
  const F3 to = take_step(packet, v, u);
  samples_ += hwy::PopCount(packet.alive);
  std::uint32_t stop = 0, leave = 0;
  if (HWY_UNLIKELY(packet.near_border)) leave = outside(packet, to);
  if (HWY_UNLIKELY(packet.near_surface || may_stop_ || !(packet.greatest_reach <= strongest_kick)))
    stop = stopped(packet, to, v);
  if (HWY_UNLIKELY(packet.steps >= packet.most_steps)) stop |= spent(packet);
  stop &= packet.alive;
  if constexpr (differentials) {  // Those of a crossing are the reference's.
    stop |= leave;
    stop &= packet.alive;
    leave = 0;
  } else {
    leave &= packet.alive & ~stop;
  }
  if (HWY_UNLIKELY((stop | leave) != 0)) take_out(packet, stop, leave);
  store(to, packet.p);
  store(v, packet.v);
  if constexpr (!uniform) store(u, packet.u);
  hn::Store(hn::Add(hn::Load(floats, packet.length), hn::Load(floats, packet.time)), floats, packet.length);
  ++packet.steps;
  if constexpr (differentials)
    for (int i = 0; i < 2; ++i) {
      store(load(packet.dp_next[i]), packet.dp[i]);
      store(load(packet.dv_next[i]), packet.dv[i]);
    }
  if (HWY_UNLIKELY(!batch_.points.empty())) keep_points(packet);
  if (HWY_UNLIKELY((stop | leave) != 0) && packet.alive != 0) repeat_one_alive(packet);
}

/// The step that leaves the extent, repeated with the length that ends on its face (Newton's method).
template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::land(Packet& packet) {
  repeat_one_alive(packet);
  packet.clamps = true;
  const F zero = hn::Zero(floats), one = set(1), longest = hn::Load(floats, packet.time);
  F3 v, u;
  locate(packet, longest);
  interpolate(packet);
  F3 to = take_step(packet, v, u);
  const F3 from = load(packet.p), chord{hn::Sub(to.x, from.x), hn::Sub(to.y, from.y), hn::Sub(to.z, from.z)};
  const auto face = [&](F along, int axis) HWY_ATTR {
    const F margin = set(medium_.margin[axis]);
    return hn::IfThenElse(hn::Gt(along, zero), hn::Add(hn::Load(floats, packet.high[axis]), margin),
                          hn::Sub(hn::Load(floats, packet.low[axis]), margin));
  };
  const auto part = [&](F p, F along, int axis) HWY_ATTR {
    const F gap = hn::Sub(face(along, axis), p);
    return hn::IfThenElse(hn::Gt(hn::Abs(along), zero), hn::Div(gap, along), set(1e30f));
  };
  const F x = part(from.x, chord.x, 0), y = part(from.y, chord.y, 1), z = part(from.z, chord.z, 2);
  const F nearest = hn::Min(hn::Min(x, y), z);
  const Mask is_x = hn::Eq(x, nearest), is_y = hn::Eq(y, nearest);
  const auto of_axis = [&](F a, F b, F c) HWY_ATTR { return hn::IfThenElse(is_x, a, hn::IfThenElse(is_y, b, c)); };
  F time = hn::Mul(longest, hn::Min(hn::Max(nearest, zero), one));
  for (int i = 0; i < landing_steps; ++i) {
    locate(packet, time);  // Which may take lanes to other bricks.
    interpolate(packet);
    to = take_step(packet, v, u);
    const F gap = hn::Sub(of_axis(face(chord.x, 0), face(chord.y, 1), face(chord.z, 2)), of_axis(to.x, to.y, to.z));
    F rest = hn::Div(gap, of_axis(u.x, u.y, u.z));
    rest = hn::IfThenElseZero(hn::Le(hn::Abs(rest), longest), rest);  // But of light that grazes the face.
    if (i == landing_steps - 1) {
      to = mul_add(rest, u, to);
      time = hn::Add(time, rest);
    } else {
      time = hn::Min(hn::Max(hn::Add(time, rest), zero), longest);
    }
  }
  store(to, packet.p);
  store(v, packet.v);
  hn::Store(time, floats, packet.time);
  const std::uint32_t on_x = to_bits(is_x), on_y = to_bits(is_y);
  for (int lane = 0; lane < lanes; ++lane) {
    if (!(packet.alive >> lane & 1)) continue;
    KernelRay& ray = rays_[packet.ray[lane]];
    for (int axis = 0; axis < 3; ++axis) {
      ray.brick[axis] = packet.brick[axis][lane];
      ray.position[axis] = packet.p[axis][lane];
      ray.direction[axis] = packet.v[axis][lane];
    }
    ray.axis = static_cast<std::int8_t>(on_x >> lane & 1 ? 0 : on_y >> lane & 1 ? 1 : 2);
    ray.length += double{packet.time[lane]} * to_world();
    ++ray.steps;
    samples_ += 1 + landing_steps;
  }
  packet.alive = 0;
}

template <bool uniform, bool differentials>
std::uint64_t Kernel<uniform, differentials>::run() {
  for (Packet& packet : packets_) fill(packet);
  for (bool busy = true; busy;) {
    busy = false;
    for (Packet& packet : packets_) {
      if (HWY_UNLIKELY(packet.alive == 0)) continue;
      busy = true;
      locate(packet, step_time(packet, load(direction(packet))));
    }
    for (Packet& packet : packets_) interpolate(packet);
    for (int i = 0; i < in_flight; ++i) {
      Packet& packet = packets_[i];
      if (HWY_UNLIKELY(packet.alive == 0)) continue;
      step(packet);
      if (HWY_LIKELY(packet.alive != 0)) continue;
      if (leaving_[i].alive != 0) land(leaving_[i]);
      fill(packet);
    }
  }
  return samples_;
}

std::uint64_t trace(const Medium& medium, KernelRays& batch) {
  if (!batch.differentials.empty())
    return medium.uniform ? Kernel<true, true>(medium, batch).run() : Kernel<false, true>(medium, batch).run();
  return medium.uniform ? Kernel<true, false>(medium, batch).run() : Kernel<false, false>(medium, batch).run();
}

int vector_lanes() { return lanes; }

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray::packets {

HWY_EXPORT(trace);
HWY_EXPORT(vector_lanes);

namespace {

#if defined(__SSE__)
/// Tiny numbers count as zero while it lives: arithmetic with them is many times slower.
class WithoutDenormals {
 public:
  WithoutDenormals() { _mm_setcsr(before_ | 0x8040); }
  ~WithoutDenormals() { _mm_setcsr(before_); }
  WithoutDenormals(const WithoutDenormals&) = delete;
  WithoutDenormals& operator=(const WithoutDenormals&) = delete;

 private:
  const unsigned before_ = _mm_getcsr();
};
#else
struct WithoutDenormals {};
#endif

}  // namespace

bool has_kernel(BendingMethod method) { return method == BendingMethod::splitting; }

std::uint64_t run(const TensorField& field, const KernelSettings& settings, KernelRays& batch) {
  const Medium medium(field, settings);
  const WithoutDenormals guard;
  return HWY_DYNAMIC_DISPATCH(trace)(medium, batch);
}

std::vector<std::string> instruction_sets() {
  std::vector<std::string> names;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) names.push_back(hwy::TargetName(target));
  return names;
}

void use_instruction_set(const std::string& name) {
  hwy::SetSupportedTargetsForTest(0);
  if (name.empty()) return;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets())
    if (name == hwy::TargetName(target)) return hwy::SetSupportedTargetsForTest(target);
  throw std::invalid_argument("this processor has no instruction set \"" + name + "\"");
}

int lane_count() { return HWY_DYNAMIC_DISPATCH(vector_lanes)(); }

}  // namespace tensorray::packets
#endif
