#include "tracing/kernels/packet_kernel.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <stdexcept>

#include "tracing/kernels/packet.h"

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

// The code below is compiled once for each instruction set. The best one of the processor is selected at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tracing/kernels/packet_kernel.cpp"  // NOLINT
#include <hwy/foreach_target.h>                                 // IWYU pragma: keep
// Must come after foreach_target.h:
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR
// Without vectors there is no kernel: see lane_count.
constexpr int lanes = 1;
std::uint64_t trace(const PacketMedium&, KernelRays&) { return 0; }
#else

// Each needs those before it. They are parts of this namespace.
// clang-format off
#include "tracing/kernels/packet_vectors-inl.h"
#include "tracing/kernels/packet_bricks-inl.h"
#include "tracing/kernels/packet_splines-inl.h"
#include "tracing/kernels/packet_step-inl.h"
#include "tracing/kernels/packet_landing-inl.h"
// clang-format on

/// Takes rays, with or without differentials, through a field of tensors with so many components, in packets: fills a
/// packet, steps it until all of its rays have ended, and takes those that leave the extent to its faces.
template <int components, bool differentials>
class Kernel {
 public:
  Kernel(const PacketMedium& medium, KernelRays& batch) : medium_(medium), rays_(batch.rays), batch_(batch) {}

  std::uint64_t run() {
    for (Packet& packet : packets_) fill(packet);
    for (bool busy = true; busy;) {
      busy = false;
      for (Packet& packet : packets_) {
        if (packet.alive == 0) continue;
        busy = true;
        step(packet);
        if (HWY_LIKELY(packet.alive != 0)) continue;
        Packet& leaving = leaving_[&packet - packets_];
        if (leaving.alive != 0) land(leaving);
        fill(packet);
      }
    }
    return samples_;
  }

 private:
  // Number of packets that are stepped in turn. With enough vectors, the processor has work while one of them waits.
  static constexpr int in_flight = lanes > 8 ? 2 : 1;

  /// Copies a ray into a lane.
  void enter(Packet& packet, int lane) {
    const KernelRay& ray = rays_[packet.ray[lane]];
    for (int axis = 0; axis < 3; ++axis) {
      packet.now.p[axis][lane] = ray.place.position[axis];
      packet.now.v[axis][lane] = ray.direction[axis];
      packet.brick[axis][lane] = ray.place.brick[axis];
      packet.first[axis][lane] = ray.place.position[axis];
      if constexpr (differentials)
        for (int i = 0; i < 2; ++i) {
          packet.now.dp[i][axis][lane] = batch_.differentials[packet.ray[lane]].position[i][axis] * medium_.unit;
          packet.now.dv[i][axis][lane] = batch_.differentials[packet.ray[lane]].direction[i][axis] * medium_.unit;
        }
    }
    packet.kick[lane] = ray.strength;
    packet.length[lane] = 0;
    packet.log_radiance_scale[lane] = 0;
  }

  /// Copies a ray, without the values that depend on its brick (see `begin`).
  static void copy_lane(const Packet& from, int of, Packet& to, int lane) {
    copy_state<differentials>(from.now, of, to.now, lane);
    for (int axis = 0; axis < 3; ++axis) {
      to.brick[axis][lane] = from.brick[axis][of];
      to.first[axis][lane] = from.first[axis][of];
    }
    to.kick[lane] = from.kick[of];
    to.length[lane] = from.length[of];
    to.log_radiance_scale[lane] = from.log_radiance_scale[of];
    to.time[lane] = from.time[of];
    to.wanted[lane] = from.wanted[of];
    to.ray[lane] = from.ray[of];
  }

  /// Moves the remaining rays to the front if that frees a vector. The other lanes repeat one of these rays.
  void compact(Packet& packet) {
    const int count = static_cast<int>(hwy::PopCount(packet.alive));
    if (count <= (packet.vectors - 1) * lanes) {
      int to = 0;
      for_lanes(packet.alive, [&](int lane) {
        if (to != lane) copy_lane(packet, lane, packet, to);
        ++to;
      });
      packet.vectors = (count + lanes - 1) / lanes;
      packet.alive = ~0u >> (packet_rays - count);
    }
    const int of = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(packet.alive));
    for (int lane = 0; lane < packet.vectors * lanes; ++lane)
      if (!(packet.alive >> lane & 1)) copy_lane(packet, of, packet, lane);
    begin(medium_, packet);
  }

  void fill(Packet& packet) {
    if (next_ == rays_.size()) return;
    const int count = static_cast<int>(std::min<std::size_t>(packet_rays, rays_.size() - next_));
    packet.alive = ~0u >> (packet_rays - count);
    packet.vectors = packet_rays / lanes;
    packet.steps = 0;
    packet.step_limit = medium_.settings.max_steps;
    alignas(64) PerRay norms = {};
    for (int lane = 0; lane < count; ++lane) {
      packet.ray[lane] = static_cast<std::int32_t>(next_++);
      enter(packet, lane);
      const KernelRay& ray = rays_[packet.ray[lane]];
      norms[lane] = ray.norm;
      packet.step_limit = std::min(packet.step_limit, medium_.settings.max_steps - ray.steps);
    }
    for (int i = 0; i < packet_rays; i += lanes)
      store(index_direction(medium_, load(packet.now.v, i)), packet.now.u, i);
    begin_steps(medium_, packet, norms);
    if (count < packet_rays)
      compact(packet);
    else
      begin(medium_, packet);
  }

  /// The lanes that cannot take this step, as bits. Sets those that meet a surface.
  /// @param tested  The lanes that end their steps. @param leave  Those that end them outside the extent.
  HWY_NOINLINE std::uint32_t stopped(Packet& packet, std::uint32_t tested, std::uint32_t leave) const {
    std::uint32_t stop = 0;
    for (int i = 0; i < packet.vectors * lanes; i += lanes) {
      const F3 v = load(packet.next.v, i);
      stop |= to_bits(hn::Not(hn::Gt(dot(v, v), set(0.5f))), i);  // The ray has no direction.
    }
    if (!packet.near_surface && !medium_.bounded) return stop;
    const std::uint32_t near = packet.near_surface ? near_surfaces(medium_, packet, tested & ~stop) : 0;
    for_lanes(medium_.bounded ? tested & ~stop : near, [&](int lane) {
      const std::int32_t ray = packet.ray[lane];
      const float before = static_cast<float>(rays_[ray].length);  // Length of the path up to the field.
      if (packet.length[lane] + packet.time[lane] + before >= medium_.settings.max_length)
        stop |= 1u << lane;
      else if (near >> lane & 1 && step_meets_surface(medium_, packet, lane, leave >> lane & 1, batch_.landings[ray]))
        packet.lands |= 1u << lane;
    });
    return stop;
  }

  /// The lanes that may take no further step, as bits. Rays that have crossed a cut have taken more steps than the
  /// packet counts.
  HWY_NOINLINE std::uint32_t spent(const Packet& packet) const {
    std::uint32_t result = 0;
    for_lanes(packet.alive, [&](int lane) {
      if (rays_[packet.ray[lane]].steps + packet.steps >= medium_.settings.max_steps) result |= 1u << lane;
    });
    return result;
  }

  /// Writes back the rays of some lanes, as they were before the step, and removes them from the packet.
  HWY_NOINLINE void retire(Packet& packet, std::uint32_t stop, std::uint32_t leave) {
    Packet& leaving = leaving_[&packet - packets_];
    for_lanes(stop | leave, [&](int lane) {
      KernelRay& ray = rays_[packet.ray[lane]];
      for (int axis = 0; axis < 3; ++axis) {
        ray.place.brick[axis] = packet.brick[axis][lane];
        ray.place.position[axis] = packet.now.p[axis][lane];
        ray.direction[axis] = packet.now.v[axis][lane];
        ray.end[axis] = packet.next.p[axis][lane];
        ray.end_direction[axis] = packet.next.v[axis][lane];
        if constexpr (differentials)
          for (int i = 0; i < 2; ++i) {
            batch_.differentials[packet.ray[lane]].position[i][axis] = packet.now.dp[i][axis][lane] / medium_.unit;
            batch_.differentials[packet.ray[lane]].direction[i][axis] = packet.now.dv[i][axis][lane] / medium_.unit;
          }
      }
      ray.length += double{packet.length[lane]};
      ray.log_radiance_scale += packet.log_radiance_scale[lane];
      ray.step = packet.time[lane];
      ray.lands = (packet.lands & stop) >> lane & 1;
      ray.steps += packet.steps;
      packet.alive &= ~(1u << lane);
      if (!(leave >> lane & 1)) return;
      const int to = static_cast<int>(hwy::PopCount(leaving.alive));
      copy_lane(packet, lane, leaving, to);
      copy_state<differentials>(packet.next, lane, leaving.next, to);
      leaving.alive = leaving.alive << 1 | 1;
    });
  }

  /// Records the points of some lanes.
  HWY_NOINLINE void keep_points(const Packet& packet, std::uint32_t which) {
    alignas(64) float positions[packet_rays][4], directions[packet_rays][4];
    alignas(64) std::int32_t bricks[packet_rays][4];
    for (int i = 0; i < packet.vectors * lanes; i += lanes) {
      const F3 p = load(packet.now.p, i), v = load(packet.now.v, i);
      hn::StoreInterleaved4(p.x, p.y, p.z, load(packet.length, i), floats, positions[i]);
      hn::StoreInterleaved4(v.x, v.y, v.z, v.z, floats, directions[i]);
      const auto brick = [&](int axis) HWY_ATTR { return hn::Load(ints, packet.brick[axis] + i); };
      hn::StoreInterleaved4(brick(0), brick(1), brick(2), brick(2), ints, bricks[i]);
    }
    for_lanes(which, [&](int lane) {
      auto* const point = reinterpret_cast<unsigned char*>(&batch_.points[packet.ray[lane]]->emplace_back());
      std::memcpy(point + offsetof(StepPoint, position), positions[lane], sizeof positions[lane]);
      std::memcpy(point + offsetof(StepPoint, direction), directions[lane], sizeof directions[lane]);
      std::memcpy(point + offsetof(StepPoint, brick), bricks[lane], sizeof bricks[lane]);
    });
  }

  /// Moves the rays to the ends of their steps.
  HWY_INLINE void add_step(Packet& packet) {
    for (int i = 0; i < packet.vectors * lanes; i += lanes) {
      store(load(packet.next.p, i), packet.now.p, i);
      store(load(packet.next.v, i), packet.now.v, i);
      store(load(packet.next.u, i), packet.now.u, i);
      store(hn::Add(load(packet.length, i), load(packet.time, i)), packet.length, i);
      if constexpr (differentials)
        for (int k = 0; k < 2; ++k) {
          store(load(packet.next.dp[k], i), packet.now.dp[k], i);
          store(load(packet.next.dv[k], i), packet.now.dv[k], i);
        }
      else
        store(hn::Add(load(packet.log_radiance_scale, i), load(packet.change_of_step, i)), packet.log_radiance_scale,
              i);
    }
    ++packet.steps;
  }

  /// Takes a step, and takes out the rays that it ends, as they were before it.
  HWY_NOINLINE void step(Packet& packet) {
    find_times(medium_, packet);
    std::uint32_t stop = too_short(medium_, packet);
    take_step<components, differentials>(medium_, packet);
    samples_ += hwy::PopCount(packet.alive) * static_cast<unsigned>(medium_.method.kicks);
    const std::uint32_t staying = medium_.adaptive ? control_steps<differentials>(medium_, packet) : 0;
    packet.lands = 0;
    std::uint32_t leave = 0;
    for (int axis = 0; axis < 3; ++axis) leave |= outside(medium_, packet, packet.next.p[axis], axis);
    leave &= ~staying;
    stop |= stopped(packet, packet.alive & ~staying, leave) & ~staying;
    if (packet.steps >= packet.step_limit) stop |= spent(packet);
    leave |= packet.lands;
    if constexpr (differentials) {  // The reference computes the differentials at a crossing.
      stop |= leave;
      packet.lands |= leave;
      leave = 0;
    }
    const std::uint32_t between = outside_between(medium_, packet, leave) & ~staying;
    packet.lands |= between;
    stop = (stop | between) & packet.alive;
    leave &= packet.alive & ~stop;
    if ((stop | leave) != 0) retire(packet, stop, leave);
    const std::uint32_t recorded = batch_.points.empty() ? 0 : packet.alive & ~staying;
    for_lanes(recorded, [&](int lane) { add_inner_points(medium_, packet, lane, *batch_.points[packet.ray[lane]]); });
    add_step(packet);
    if (recorded != 0) keep_points(packet, recorded);
    if ((stop | leave) != 0 && packet.alive != 0) compact(packet);
  }

  /// Sets the planes of the lanes whose steps meet a surface.
  HWY_NOINLINE void set_planes(const Packet& packet, FaceLanding& landing) const {
    for (int lane = 0; lane < packet.vectors * lanes; ++lane) {
      const SurfaceLanding& met = batch_.landings[packet.ray[lane]];
      landing.part[lane] = met.part;
      landing.to_plane[lane] = met.to_plane;
      for (int axis = 0; axis < 3; ++axis) landing.normal[axis][lane] = met.normal[axis];
    }
  }

  /// Repeats the step that leaves the extent or meets a surface, with the length that ends there.
  HWY_NOINLINE void land(Packet& packet) {
    packet.vectors = packet_rays / lanes;
    for (int lane = static_cast<int>(hwy::PopCount(packet.alive)); lane < packet_rays; ++lane)
      copy_state<differentials>(packet.next, 0, packet.next, lane);
    compact(packet);
    FaceLanding landing;
    landing.on_surfaces = !batch_.landings.empty();
    if (landing.on_surfaces) set_planes(packet, landing);
    aim_along_chord(medium_, packet, landing);
    aim_along_path(medium_, packet, landing);
    take_step<components, differentials>(medium_, packet);
    move_to_faces(medium_, packet, landing);
    for_lanes(packet.alive, [&](int lane) {
      KernelRay& ray = rays_[packet.ray[lane]];
      for (int axis = 0; axis < 3; ++axis) {
        ray.place.brick[axis] = packet.brick[axis][lane];
        ray.place.position[axis] = packet.next.p[axis][lane];
        ray.direction[axis] = packet.next.v[axis][lane];
      }
      ray.axis = static_cast<std::int8_t>(landing.axis[lane]);
      ray.length += double{packet.time[lane]};
      ray.log_radiance_scale += packet.change_of_step[lane];
      ++ray.steps;
      samples_ += static_cast<unsigned>(medium_.method.kicks);
    });
    packet.alive = 0;
  }

  const PacketMedium& medium_;
  std::vector<KernelRay>& rays_;
  KernelRays& batch_;
  std::size_t next_ = 0;  // The first ray that no packet has held yet.
  std::uint64_t samples_ = 0;
  Packet packets_[in_flight];
  /// Rays of these packets that leave the extent, as they were before their last step, and the end of that step.
  Packet leaving_[in_flight];
};

template <int components>
std::uint64_t trace_components(const PacketMedium& medium, KernelRays& batch) {
  return batch.differentials.empty() ? Kernel<components, false>(medium, batch).run()
                                     : Kernel<components, true>(medium, batch).run();
}

std::uint64_t trace(const PacketMedium& medium, KernelRays& batch) {
  return medium.field.is_symmetric() ? trace_components<TensorBrick::symmetric>(medium, batch)
                                     : trace_components<TensorBrick::general>(medium, batch);
}

#endif

int vector_lanes() { return lanes; }

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray::packets {

HWY_EXPORT(trace);
HWY_EXPORT(vector_lanes);

namespace {

/// Zen 4 does the operations of AVX-512 in two halves: the kernel, of all code with vectors, is faster with AVX2 there.
bool is_zen4() {
#if defined(__x86_64__) && defined(__GNUC__)
  __builtin_cpu_init();
  return __builtin_cpu_is("amd") && __builtin_cpu_supports("avx512f") &&
         !__builtin_cpu_supports("avx512vp2intersect");  // Zen 5 has it.
#else
  return false;
#endif
}

/// Whether the kernel does not use vectors wider than AVX2's.
bool prefers_avx2 = is_zen4();

/// The function for the instruction set that is selected. It must be exported (HWY_EXPORT).
#if HWY_TARGETS & HWY_AVX2
#define KERNEL_DISPATCH(function) (prefers_avx2 ? &N_AVX2::function : &HWY_DYNAMIC_DISPATCH(function))
#else
#define KERNEL_DISPATCH(function) HWY_DYNAMIC_DISPATCH(function)
#endif

#if defined(__SSE__)
/// Denormal numbers count as zero during the lifetime of this object, because arithmetic with them is many times
/// slower.
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

/// The processor's instruction sets.
const std::vector<std::int64_t>& targets() {
  static const std::vector<std::int64_t> all = [] {
    std::vector<std::int64_t> with_vectors = hwy::SupportedAndGeneratedTargets();
    with_vectors.erase(std::remove(with_vectors.begin(), with_vectors.end(), HWY_SCALAR), with_vectors.end());
    return with_vectors;
  }();
  return all;
}

}  // namespace

int lane_count() { return KERNEL_DISPATCH(vector_lanes)(); }

std::uint64_t run(const TensorField& field, const KernelSettings& settings, KernelRays& batch) {
  const PacketMedium medium(field, settings);
  if (settings.geometry) batch.landings.assign(batch.rays.size(), {});
  [[maybe_unused]] const WithoutDenormals guard;
  return KERNEL_DISPATCH(trace)(medium, batch);
}

std::vector<std::string> instruction_sets() {
  std::vector<std::string> names;
  for (const std::int64_t target : targets()) names.push_back(hwy::TargetName(target));
  return names;
}

void use_instruction_set(const std::string& name) {
  const auto found = std::find_if(targets().begin(), targets().end(),
                                  [&](std::int64_t target) { return name == hwy::TargetName(target); });
  if (found == targets().end() && !name.empty())
    throw std::invalid_argument("this processor has no instruction set \"" + name + "\"");
  prefers_avx2 = name.empty() && is_zen4();
  hwy::SetSupportedTargetsForTest(name.empty() ? 0 : *found);
}

}  // namespace tensorray::packets
#endif
