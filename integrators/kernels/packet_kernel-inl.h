/// @file integrators/kernels/packet_kernel-inl.h
/// The kernel: takes rays through the field, in packets. A part of packet_kernel.cpp and packet_kernel_cubic.cpp.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_KERNEL_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_KERNEL_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_KERNEL_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_KERNEL_TOGGLE
#endif

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include <hwy/highway.h>

#include "integrators/kernels/packet_composition-inl.h"
#include "integrators/kernels/packet_landing-inl.h"
#include "integrators/kernels/packet_stages-inl.h"
#include "integrators/packets/packet_medium.h"
#include "integrators/packets/packet_path.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

/// The kernel, for fields of one kind (`Bricks`), whose voxels are cubes along the axes (`uniform`) or have any other
/// shape, for rays with or without differentials, whose changes of radiance are wanted or not.
template <class Bricks, bool uniform, bool differentials, bool changes>
class Kernel {
 public:
  Kernel(const PacketMedium& medium, KernelRays& batch) : medium_(medium), rays_(batch.rays), batch_(batch) {}

  std::uint64_t run();

 private:
  // Number of packets that are stepped in turn. With enough vectors, the processor has work while one of them waits.
  static constexpr int in_flight = lanes > 8 ? 2 : 1;

  void fill(Packet& packet);
  void enter(Packet& packet, int lane);
  static void copy_lane(const Packet& from, int of, Packet& to, int lane);
  static void copy_end(const Packet& from, int of, Packet& to, int lane);
  void compact(Packet& packet);
  void step_split(Packet& packet);
  void step_watched(Packet& packet);
  void step_otherwise(Packet& packet);
  void attempt(Packet& packet);
  void end_step(Packet& packet, std::uint32_t staying, std::uint32_t stop);
  std::uint32_t outside(const Packet& packet, const PerRay& points, int axis) const;
  std::uint32_t outside(const Packet& packet, const PerRay (&points)[3]) const;
  std::uint32_t stopped(Packet& packet) const;
  std::uint32_t spent(const Packet& packet) const;
  void locate_on_extent(Packet& packet);
  void add_step(Packet& packet);
  void retire(Packet& packet, std::uint32_t stop, std::uint32_t leave);
  void keep_points(const Packet& packet, std::uint32_t which);
  std::uint32_t outside_between(const Packet& packet, std::uint32_t leave) const;
  unsigned samples_per_step() const {
    return medium_.stages ? medium_.stages->stages : medium_.composed ? Composition::kicks : 1;
  }
  bool is_composed() const { return !uniform && medium_.composed; }
  int landing_count() const { return is_composed() ? composed_landing_steps : landing_steps; }
  float to_world() const { return uniform ? medium_.voxel : 1.0f; }  // World units per unit of `time`.
  void land(Packet& packet);
  void arrive(Packet& packet, const FaceLanding& landing);

  const PacketMedium& medium_;
  std::vector<KernelRay>& rays_;
  KernelRays& batch_;
  std::size_t next_ = 0;  // The first ray that no packet has held yet.
  std::uint64_t samples_ = 0;
  Packet packets_[in_flight];
  /// Rays of these packets that leave the extent, as they were before their last step, and the end of that step.
  Packet leaving_[in_flight];
};

/// Copies a ray into a lane.
template <class Bricks, bool uniform, bool differentials, bool changes>
void Kernel<Bricks, uniform, differentials, changes>::enter(Packet& packet, int lane) {
  const KernelRay& ray = rays_[packet.ray[lane]];
  for (int axis = 0; axis < 3; ++axis) {
    packet.p[axis][lane] = ray.place.position[axis];
    packet.v[axis][lane] = ray.direction[axis];
    packet.brick[axis][lane] = ray.place.brick[axis];
    if constexpr (differentials)
      for (int i = 0; i < 2; ++i) {
        packet.dp[i][axis][lane] = batch_.differentials[packet.ray[lane]].position[i][axis] * medium_.unit;
        packet.dv[i][axis][lane] = batch_.differentials[packet.ray[lane]].direction[i][axis] * medium_.unit;
      }
  }
  packet.kick[lane] = uniform ? ray.strength * medium_.voxel : ray.strength;
  packet.bending_rate[lane] = std::fabs(packet.kick[lane]) * ray.norm;
  packet.wanted[lane] = medium_.settings.step;
  packet.length[lane] = 0;
  if constexpr (changes) packet.log_radiance_scale[lane] = 0;
}

/// Copies a ray, without the values that depend on its brick (see `begin`).
template <class Bricks, bool uniform, bool differentials, bool changes>
void Kernel<Bricks, uniform, differentials, changes>::copy_lane(const Packet& from, int of, Packet& to, int lane) {
  for (int axis = 0; axis < 3; ++axis) {
    to.p[axis][lane] = from.p[axis][of];
    to.v[axis][lane] = from.v[axis][of];
    if constexpr (!uniform) to.u[axis][lane] = from.u[axis][of];
    to.brick[axis][lane] = from.brick[axis][of];
    if constexpr (differentials)
      for (int i = 0; i < 2; ++i) {
        to.dp[i][axis][lane] = from.dp[i][axis][of];
        to.dv[i][axis][lane] = from.dv[i][axis][of];
      }
  }
  to.kick[lane] = from.kick[of];
  to.length[lane] = from.length[of];
  if constexpr (changes) to.log_radiance_scale[lane] = from.log_radiance_scale[of];
  to.bending_rate[lane] = from.bending_rate[of];
  to.time[lane] = from.time[of];
  to.wanted[lane] = from.wanted[of];
  to.ray[lane] = from.ray[of];
}

/// Copies the end of a lane's step.
template <class Bricks, bool uniform, bool differentials, bool changes>
void Kernel<Bricks, uniform, differentials, changes>::copy_end(const Packet& from, int of, Packet& to, int lane) {
  for (int axis = 0; axis < 3; ++axis) {
    to.p_next[axis][lane] = from.p_next[axis][of];
    to.v_next[axis][lane] = from.v_next[axis][of];
    if constexpr (!uniform) to.u_next[axis][lane] = from.u_next[axis][of];
  }
}

/// Moves the remaining rays to the front if that frees a vector. The other lanes repeat one of these rays.
template <class Bricks, bool uniform, bool differentials, bool changes>
void Kernel<Bricks, uniform, differentials, changes>::compact(Packet& packet) {
  const int count = static_cast<int>(hwy::PopCount(packet.alive));
  if (count <= (packet.vectors - 1) * lanes) {
    int to = 0;
    for (std::uint32_t rest = packet.alive; rest != 0; rest &= rest - 1, ++to) {
      const int lane = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest));
      if (to != lane) copy_lane(packet, lane, packet, to);
    }
    packet.vectors = (count + lanes - 1) / lanes;
    packet.alive = ~0u >> (packet_rays - count);
  }
  const int of = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(packet.alive));
  for (int lane = 0; lane < packet.vectors * lanes; ++lane)
    if (!(packet.alive >> lane & 1)) copy_lane(packet, of, packet, lane);
  begin<uniform>(medium_, packet);
}

template <class Bricks, bool uniform, bool differentials, bool changes>
void Kernel<Bricks, uniform, differentials, changes>::fill(Packet& packet) {
  if (next_ == rays_.size()) return;
  const int count = static_cast<int>(std::min<std::size_t>(packet_rays, rays_.size() - next_));
  packet.alive = ~0u >> (packet_rays - count);
  packet.vectors = packet_rays / lanes;
  packet.clamps = medium_.clamps;
  packet.steps = 0;
  packet.most_steps = medium_.settings.max_steps;
  for (int lane = 0; lane < count; ++lane) {
    packet.ray[lane] = static_cast<std::int32_t>(next_++);
    enter(packet, lane);
    packet.most_steps = std::min(packet.most_steps, medium_.settings.max_steps - rays_[packet.ray[lane]].steps);
  }
  if constexpr (!uniform)
    for (int i = 0; i < packet_rays; i += lanes)
      store(index_direction<uniform>(medium_, load(packet.v, i)), packet.u, i);
  if (!uniform && medium_.adaptive && medium_.settings.step == 0) begin_steps<uniform>(medium_, packet);
  if (count < packet_rays)
    compact(packet);
  else
    begin<uniform>(medium_, packet);
}

/// The lanes whose points are outside the extent along an axis, as bits.
template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_INLINE std::uint32_t Kernel<Bricks, uniform, differentials, changes>::outside(const Packet& packet,
                                                                                  const PerRay& points,
                                                                                  int axis) const {
  std::uint32_t result = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F x = load(points, i), margin = set(medium_.margin[axis]);
    result |= to_bits(hn::Or(hn::Lt(hn::Add(x, margin), load(packet.low[axis], i)),
                             hn::Gt(hn::Sub(x, margin), load(packet.high[axis], i))),
                      i);
  }
  return result;
}

template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_INLINE std::uint32_t Kernel<Bricks, uniform, differentials, changes>::outside(const Packet& packet,
                                                                                  const PerRay (&points)[3]) const {
  return outside(packet, points[0], 0) | outside(packet, points[1], 1) | outside(packet, points[2], 2);
}

/// The lanes whose long steps leave the extent between their ends, as bits. Lanes that leave it only once, along one
/// axis, are not among them: the packet can find where they leave.
template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_NOINLINE std::uint32_t Kernel<Bricks, uniform, differentials, changes>::outside_between(const Packet& packet,
                                                                                            std::uint32_t leave) const {
  std::uint32_t any = 0, edges = 0;
  alignas(64) PerRay points[3][3];
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < packet.vectors * lanes; i += lanes)
      store(path_at<uniform>(packet, path_weights(0.25 * (k + 1)), i), points[k], i);
  for (int axis = 0; axis < 3; ++axis) {
    std::uint32_t along = outside(packet, packet.p_next[axis], axis);
    for (const auto& point : points) along |= outside(packet, point[axis], axis);
    edges |= along & (any | turning<uniform>(packet, axis));
    any |= along;
  }
  return (any & ~leave) | edges;
}

/// The lanes that cannot take this step, as bits. Sets those that meet a surface.
template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_NOINLINE std::uint32_t Kernel<Bricks, uniform, differentials, changes>::stopped(Packet& packet) const {
  std::uint32_t stop = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F3 v = load(packet.v_next, i);
    stop |= to_bits(hn::Not(hn::Gt(dot(v, v), set(0.5f))), i);  // The ray has no direction.
  }
  if (!packet.near_surface && !medium_.bounded) return stop;
  for (std::uint32_t rest = packet.alive; rest != 0; rest &= rest - 1) {
    const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(rest);
    const float before = static_cast<float>(rays_[packet.ray[lane]].length);  // Length of the path up to the field.
    const float length = (packet.length[lane] + packet.time[lane]) * to_world() + before;
    if (length >= medium_.settings.max_length)
      stop |= 1u << lane;
    else if (packet.near_surface && step_meets_surface(medium_, packet, static_cast<int>(lane)))
      packet.lands |= 1u << lane;
  }
  return stop | packet.lands;
}

/// The lanes that may take no further step, as bits. Rays that have crossed a cut have taken more steps than the
/// packet counts.
template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_NOINLINE std::uint32_t Kernel<Bricks, uniform, differentials, changes>::spent(const Packet& packet) const {
  std::uint32_t result = 0;
  for (std::uint32_t rest = packet.alive; rest != 0; rest &= rest - 1) {
    const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(rest);
    if (rays_[packet.ray[lane]].steps + packet.steps >= medium_.settings.max_steps) result |= 1u << lane;
  }
  return result;
}

/// Moves the middles of steps that lie outside the extent to the nearest points on it, where the tensor is that of the
/// outermost voxels. Light may turn back into the extent from there.
template <class Bricks, bool uniform, bool differentials, bool changes>
void Kernel<Bricks, uniform, differentials, changes>::locate_on_extent(Packet& packet) {
  packet.clamps = true;
  sample_middles<Bricks, uniform, differentials>(medium_, packet);
  packet.clamps = medium_.clamps;
}

/// Writes back the rays of some lanes, as they were before the step, and removes them from the packet.
template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_NOINLINE void Kernel<Bricks, uniform, differentials, changes>::retire(Packet& packet, std::uint32_t stop,
                                                                          std::uint32_t leave) {
  Packet& leaving = leaving_[&packet - packets_];
  for (std::uint32_t rest = stop | leave; rest != 0; rest &= rest - 1) {
    const int lane = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest));
    KernelRay& ray = rays_[packet.ray[lane]];
    for (int axis = 0; axis < 3; ++axis) {
      ray.place.brick[axis] = packet.brick[axis][lane];
      ray.place.position[axis] = packet.p[axis][lane];
      ray.direction[axis] = packet.v[axis][lane];
      if constexpr (differentials)
        for (int i = 0; i < 2; ++i) {
          batch_.differentials[packet.ray[lane]].position[i][axis] = packet.dp[i][axis][lane] / medium_.unit;
          batch_.differentials[packet.ray[lane]].direction[i][axis] = packet.dv[i][axis][lane] / medium_.unit;
        }
    }
    ray.length += double{packet.length[lane]} * to_world();
    if constexpr (changes) ray.log_radiance_scale += packet.log_radiance_scale[lane];
    ray.step = packet.time[lane] * to_world();
    ray.lands = (packet.lands & stop) >> lane & 1;
    for (int axis = 0; axis < 3; ++axis) {
      ray.end[axis] = packet.p_next[axis][lane];
      ray.end_direction[axis] = packet.v_next[axis][lane];
    }
    ray.steps += packet.steps;
    packet.alive &= ~(1u << lane);
    if (!(leave >> lane & 1)) continue;
    const int to = static_cast<int>(hwy::PopCount(leaving.alive));
    copy_lane(packet, lane, leaving, to);
    copy_end(packet, lane, leaving, to);
    leaving.alive = leaving.alive << 1 | 1;
  }
}

/// Records the points of some lanes.
template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_NOINLINE void Kernel<Bricks, uniform, differentials, changes>::keep_points(const Packet& packet,
                                                                               std::uint32_t which) {
  alignas(64) float positions[packet_rays][4], directions[packet_rays][4];
  alignas(64) std::int32_t bricks[packet_rays][4];
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F3 p = load(packet.p, i), v = load(packet.v, i);
    const F length = hn::Mul(load(packet.length, i), set(to_world()));
    hn::StoreInterleaved4(p.x, p.y, p.z, length, floats, positions[i]);
    hn::StoreInterleaved4(v.x, v.y, v.z, v.z, floats, directions[i]);
    const auto brick = [&](int axis) HWY_ATTR { return hn::Load(ints, packet.brick[axis] + i); };
    hn::StoreInterleaved4(brick(0), brick(1), brick(2), brick(2), ints, bricks[i]);
  }
  for (std::uint32_t rest = which; rest != 0; rest &= rest - 1) {
    const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(rest);
    auto* const point = reinterpret_cast<unsigned char*>(&batch_.points[packet.ray[lane]]->emplace_back());
    std::memcpy(point + offsetof(StepPoint, position), positions[lane], sizeof positions[lane]);
    std::memcpy(point + offsetof(StepPoint, direction), directions[lane], sizeof directions[lane]);
    std::memcpy(point + offsetof(StepPoint, brick), bricks[lane], sizeof bricks[lane]);
  }
}

/// Adds a step to what the lanes have travelled.
template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_INLINE void Kernel<Bricks, uniform, differentials, changes>::add_step(Packet& packet) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    store(hn::Add(load(packet.length, i), load(packet.time, i)), packet.length, i);
    if constexpr (changes)
      store(hn::Add(load(packet.log_radiance_scale, i), load(packet.change_of_step, i)), packet.log_radiance_scale, i);
  }
  ++packet.steps;
}

/// Ends a step. Takes out the rays that it ends, as they were before it: those of `stop` and those found here, except
/// for lanes that are `staying`.
template <class Bricks, bool uniform, bool differentials, bool changes>
void Kernel<Bricks, uniform, differentials, changes>::end_step(Packet& packet, std::uint32_t staying,
                                                               std::uint32_t stop) {
  std::uint32_t leave = 0;
  packet.lands = 0;
  if (packet.near_border) leave = outside(packet, packet.p_next) & ~staying;
  const bool may_fail = Bricks::cubic || medium_.settings.method != BendingMethod::splitting;
  if (may_fail || packet.near_surface || medium_.bounded || !(packet.greatest_reach <= strongest_kick))
    stop |= stopped(packet) & ~staying;
  if (packet.steps >= packet.most_steps) stop |= spent(packet);
  if constexpr (differentials) {  // The reference computes the differentials at a crossing.
    stop |= leave;
    packet.lands |= leave;
    leave = 0;
  }
  if (is_composed() && packet.near_border) {
    const std::uint32_t between = outside_between(packet, leave) & ~staying;
    stop |= between;
    packet.lands |= between;
  }
  stop &= packet.alive;
  leave &= packet.alive & ~stop;
  if ((stop | leave) != 0) retire(packet, stop, leave);
  if (is_composed() && !batch_.points.empty())
    for (std::uint32_t rest = packet.alive & ~staying; rest != 0; rest &= rest - 1) {
      const auto lane = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest));
      add_inner_points(medium_, packet, lane, *batch_.points[packet.ray[lane]]);
    }
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    store(load(packet.p_next, i), packet.p, i);
    store(load(packet.v_next, i), packet.v, i);
    if constexpr (!uniform) store(load(packet.u_next, i), packet.u, i);
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) {
        store(load(packet.dp_next[k], i), packet.dp[k], i);
        store(load(packet.dv_next[k], i), packet.dv[k], i);
      }
  }
  add_step(packet);
  if (!batch_.points.empty()) keep_points(packet, packet.alive & ~staying);
  if ((stop | leave) != 0 && packet.alive != 0) compact(packet);
}

/// The second part of a step that may end rays.
template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_NOINLINE void Kernel<Bricks, uniform, differentials, changes>::step_watched(Packet& packet) {
  if (packet.near_border && (outside(packet, packet.middle) & packet.alive) != 0) locate_on_extent(packet);
  take_step<Bricks, uniform, differentials, changes>(medium_, packet, packet.p_next, packet.v_next, packet.u_next);
  end_step(packet, 0, 0);
}

template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_INLINE void Kernel<Bricks, uniform, differentials, changes>::step_split(Packet& packet) {
  locate_middles<Bricks, uniform, differentials>(medium_, packet);
  interpolate<Bricks, uniform, differentials>(packet);
  samples_ += hwy::PopCount(packet.alive);
  if (differentials || HWY_UNLIKELY(packet.watched || packet.steps >= packet.most_steps)) return step_watched(packet);
  take_step<Bricks, uniform, differentials, changes>(medium_, packet, packet.p, packet.v, packet.u);
  add_step(packet);
  if (HWY_UNLIKELY(!batch_.points.empty())) keep_points(packet, packet.alive);
}

/// Computes the positions after a step of length `time`. May move lanes to other bricks.
template <class Bricks, bool uniform, bool differentials, bool changes>
void Kernel<Bricks, uniform, differentials, changes>::attempt(Packet& packet) {
  if constexpr (!uniform) {
    if (medium_.composed) return step_by_composition<Bricks, uniform, differentials, changes>(medium_, packet);
    if (medium_.stages) return step_by_stages<Bricks, uniform, differentials, changes>(medium_, packet);
    if (medium_.settings.method == BendingMethod::euler)
      return step_by_euler<Bricks, uniform, differentials, changes>(medium_, packet);
  }
  sample_middles<Bricks, uniform, differentials>(medium_, packet);
  take_step<Bricks, uniform, differentials, changes>(medium_, packet, packet.p_next, packet.v_next, packet.u_next);
}

/// A step of a method other than splitting.
template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_NOINLINE void Kernel<Bricks, uniform, differentials, changes>::step_otherwise(Packet& packet) {
  const std::uint32_t stop = too_short<uniform>(medium_, packet);
  attempt(packet);
  samples_ += hwy::PopCount(packet.alive) * samples_per_step();
  const std::uint32_t staying = medium_.adaptive ? control_steps<uniform, differentials>(medium_, packet) : 0;
  end_step(packet, staying, stop);
}

/// Repeats the step that leaves the extent, with the length that ends on its face (Newton's method).
template <class Bricks, bool uniform, bool differentials, bool changes>
HWY_NOINLINE void Kernel<Bricks, uniform, differentials, changes>::land(Packet& packet) {
  packet.vectors = packet_rays / lanes;
  for (int lane = static_cast<int>(hwy::PopCount(packet.alive)); lane < packet_rays; ++lane)
    copy_end(packet, 0, packet, lane);
  compact(packet);
  packet.clamps = true;
  FaceLanding landing;
  aim(medium_, packet, landing);
  if (is_composed()) aim_along_path<uniform>(medium_, packet, landing);
  for (int n = 0; n < landing_count(); ++n) {
    attempt(packet);
    if (n < landing_count() - 1)
      improve<uniform>(medium_, packet, landing);
    else
      move_to_faces<uniform>(medium_, packet, landing);
  }
  arrive(packet, landing);
}

/// Writes back the rays, which are on the extent's faces.
template <class Bricks, bool uniform, bool differentials, bool changes>
void Kernel<Bricks, uniform, differentials, changes>::arrive(Packet& packet, const FaceLanding& landing) {
  for (std::uint32_t rest = packet.alive; rest != 0; rest &= rest - 1) {
    const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(rest);
    KernelRay& ray = rays_[packet.ray[lane]];
    for (int axis = 0; axis < 3; ++axis) {
      ray.place.brick[axis] = packet.brick[axis][lane];
      ray.place.position[axis] = packet.p_next[axis][lane];
      ray.direction[axis] = packet.v_next[axis][lane];
    }
    ray.axis = static_cast<std::int8_t>(landing.axis[lane]);
    ray.length += double{packet.time[lane]} * to_world();
    if constexpr (changes) ray.log_radiance_scale += packet.change_of_step[lane];
    ++ray.steps;
    samples_ += landing_count() * samples_per_step();
  }
  packet.alive = 0;
}

template <class Bricks, bool uniform, bool differentials, bool changes>
std::uint64_t Kernel<Bricks, uniform, differentials, changes>::run() {
  [[maybe_unused]] const bool otherwise = medium_.settings.method != BendingMethod::splitting;
  for (Packet& packet : packets_) fill(packet);
  for (bool busy = true; busy;) {
    busy = false;
    for (Packet& packet : packets_) {
      if (packet.alive == 0) continue;
      busy = true;
      if (HWY_UNLIKELY(!packet.timed)) find_times<uniform>(medium_, packet);
      if constexpr (Bricks::cubic)
        step_otherwise(packet);
      else if constexpr (uniform)
        step_split(packet);
      else
        otherwise ? step_otherwise(packet) : step_split(packet);
      if (HWY_LIKELY(packet.alive != 0)) continue;
      Packet& leaving = leaving_[&packet - packets_];
      if (leaving.alive != 0) land(leaving);
      fill(packet);
    }
  }
  return samples_;
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
