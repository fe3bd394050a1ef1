#include "integrators/packet_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "integrators/exponential.h"

// Compiled once for each instruction set, of which the processor's best is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "integrators/packet_kernel.cpp"  // NOLINT
#ifndef HWY_DISABLED_TARGETS
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#endif
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// Must come after it:
#include <hwy/highway.h>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#ifndef TENSORRAY_PACKET_KERNEL_ONCE
#define TENSORRAY_PACKET_KERNEL_ONCE
namespace tensorray::packets {

/// What all targets share. No function of it is inlined into code for a target that the processor may lack.
struct Medium {
  Medium(const TensorField& field, const KernelSettings& settings);

  const TensorField& field;
  const KernelSettings& settings;
  bool uniform;         // Voxels are cubes along the world's axes: index space is world space, scaled.
  float voxel;          // If so, their edge.
  float longest_voxel;  // Along any direction.
  float to_index[3][3];
  std::int32_t first[3], last[3];  // Voxels of the extent.
  float margin[3];                 // Of the extent beyond these: ½ on an axis of a single voxel.
  float longest_step;              // Voxels; but through straight bricks.

  TensorBrick brick(const std::int32_t at[3]) const { return field.brick({at[0], at[1], at[2]}); }
  bool near_surface(const std::int32_t at[3]) const;
  bool meets_surface(const double from[3], const double to[3]) const;

  /// exp(factor · T) V, normalised; zero if it has no direction.
  static void exponential(const float T[8], float factor, float V[3]);
};

constexpr int most_lanes = 16;
constexpr float longest_automatic_step = 0.5f, shortest_automatic_step = 1.0f / 64;  // Voxels; as in scalar_tracer.cpp.
constexpr float strongest_kick = 0.2f;
constexpr float past_straight_brick = 1.0f / 64;

/// With n terms the power series of exp(A) V is exact to 3e-8, half a unit in the last place, for ‖A‖ up to entry n −
/// 2: (3e-8 (n + 1)!)^(1/(n + 1)).
constexpr float series_reach[] = {0.00565f, 0.0291f, 0.0815f, 0.167f, 0.285f, 0.431f, 0.605f, 0.8f, 1.01f};
constexpr int most_terms = 10;

/// Rays side by side, one a lane. All lanes hold a ray: those whose ray has ended repeat that of another, so that no
/// step needs a mask.
struct Packet {
  alignas(64) float p[3][most_lanes];    // Position, voxels from the brick's first.
  alignas(64) float v[3][most_lanes];    // V.
  alignas(64) float u[3][most_lanes];    // The direction in index space; if voxels are uniform, V.
  alignas(64) float kick[most_lanes];    // s, times the voxel's edge if voxels are uniform.
  alignas(64) float length[most_lanes];  // Of the way since the ray came, in units of the time that u is per.
  alignas(64) float norm[most_lanes];    // Of T's deviator as last sampled, or 0.
  alignas(64) float reach[most_lanes];   // Bound on ‖s h T‖ in the brick.
  alignas(64) float strongest[most_lanes];
  alignas(64) float low[3][most_lanes], high[3][most_lanes];  // The voxels' box, relative to the brick.
  alignas(64) float margin[3][most_lanes];                    // Of the extent beyond it.
  alignas(64) float time[most_lanes];                         // Of the step being taken.
  const float* bending[most_lanes] = {};
  std::int32_t brick[most_lanes][3];
  std::int32_t ray[most_lanes];
  std::uint32_t alive = 0;  // A bit each.
  std::uint32_t steps = 0, most_steps = 0;
  float greatest_reach = 0;
  bool one_brick = false, near_border = false, near_surface = false, straight = false;
};

}  // namespace tensorray::packets
#endif

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, most_lanes>;
using Ints = hn::RebindToSigned<Floats>;
using Bits = hn::RebindToUnsigned<Floats>;
using F = hn::Vec<Floats>;
using Mask = hn::Mask<Floats>;
constexpr Floats floats;
constexpr Ints ints;
constexpr Bits bits;
constexpr int lanes = static_cast<int>(hn::MaxLanes(Floats()));

struct F3 {
  F x, y, z;
};

/// The eight components of T − T₂₂ I, column by column.
struct Tensor {
  F c[8];
};

HWY_INLINE F set(float value) { return hn::Set(floats, value); }
HWY_INLINE F3 load(const float from[3][most_lanes]) {
  return {hn::Load(floats, from[0]), hn::Load(floats, from[1]), hn::Load(floats, from[2])};
}
HWY_INLINE void store(const F3& v, float to[3][most_lanes]) {
  hn::Store(v.x, floats, to[0]);
  hn::Store(v.y, floats, to[1]);
  hn::Store(v.z, floats, to[2]);
}
HWY_INLINE F3 add(const F3& a, const F3& b) { return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)}; }
HWY_INLINE F3 mul(F s, const F3& a) { return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)}; }
HWY_INLINE F3 mul_add(F s, const F3& a, const F3& b) {
  return {hn::MulAdd(s, a.x, b.x), hn::MulAdd(s, a.y, b.y), hn::MulAdd(s, a.z, b.z)};
}
HWY_INLINE F dot(const F3& a, const F3& b) { return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z))); }
HWY_INLINE F3 select(Mask mask, const F3& yes, const F3& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y), hn::IfThenElse(mask, yes.z, no.z)};
}
HWY_INLINE std::uint32_t to_bits(Mask mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(floats, mask, bytes);
  std::uint32_t result;
  std::memcpy(&result, bytes, sizeof result);
  return result & ((1u << lanes) - 1);
}

/// T V.
HWY_INLINE F3 apply(const Tensor& T, const F3& v) {
  return {hn::MulAdd(T.c[6], v.z, hn::MulAdd(T.c[3], v.y, hn::Mul(T.c[0], v.x))),
          hn::MulAdd(T.c[7], v.z, hn::MulAdd(T.c[4], v.y, hn::Mul(T.c[1], v.x))),
          hn::MulAdd(T.c[5], v.y, hn::Mul(T.c[2], v.x))};
}

/// The trilinear polynomial of a cell in the fractions x, y, z: coefficients of 1, z, y, yz, x, xz, xy, xyz.
template <class D>
struct Polynomial {
  hn::Vec<D> k[8];
};

/// Of the components from `corner` on, of the cell's first voxel. 12 operations.
template <class D>
HWY_INLINE Polynomial<D> cell_polynomial(D d, const float* corner) {
  constexpr int z = TensorBrick::bending_floats, y = TensorBrick::width * z, x = TensorBrick::width * y;
  const auto c000 = hn::Load(d, corner), c001 = hn::Load(d, corner + z);
  const auto c010 = hn::Load(d, corner + y), c011 = hn::Load(d, corner + y + z);
  const auto c100 = hn::Load(d, corner + x), c101 = hn::Load(d, corner + x + z);
  const auto c110 = hn::Load(d, corner + x + y), c111 = hn::Load(d, corner + x + y + z);
  const auto dz = hn::Sub(c001, c000), dy = hn::Sub(c010, c000), dx = hn::Sub(c100, c000);
  const auto yz = hn::Sub(hn::Sub(c011, c010), dz);
  const auto far = hn::Sub(c101, c100), far_y = hn::Sub(c110, c100);
  const auto xyz = hn::Sub(hn::Sub(hn::Sub(c111, c110), far), yz);
  return {{c000, dz, dy, yz, dx, hn::Sub(far, dz), hn::Sub(far_y, dy), xyz}};
}

/// 7 operations; the same ones in the same order whatever D is.
template <class V>
HWY_INLINE V evaluate(V k0, V kz, V ky, V kyz, V kx, V kxz, V kxy, V kxyz, V x, V y, V z) {
  const V near = hn::MulAdd(hn::MulAdd(kyz, z, ky), y, hn::MulAdd(kz, z, k0));
  return hn::MulAdd(hn::MulAdd(hn::MulAdd(kxyz, z, kxy), y, hn::MulAdd(kxz, z, kx)), x, near);
}

using Eight = hn::CappedTag<float, 8>;  // For the components of one voxel.
constexpr Eight eight;
constexpr int eight_lanes = static_cast<int>(hn::MaxLanes(Eight()));

/// All lanes are in one cell: its polynomial is made once, and its coefficients go to all lanes.
HWY_INLINE Tensor sample_one_cell(const float* corner, const F3& f) {
  alignas(64) float k[8][8];
  for (int i = 0; i < 8; i += eight_lanes) {
    const Polynomial<Eight> polynomial = cell_polynomial(eight, corner + i);
    for (int j = 0; j < 8; ++j) hn::Store(polynomial.k[j], eight, &k[j][i]);
  }
  Tensor T;
  for (int i = 0; i < 8; ++i)
    T.c[i] = evaluate(set(k[0][i]), set(k[1][i]), set(k[2][i]), set(k[3][i]), set(k[4][i]), set(k[5][i]), set(k[6][i]),
                      set(k[7][i]), f.x, f.y, f.z);
  return T;
}

/// Lanes are in cells of their own: a vector holds the components of one lane at a time.
HWY_NOINLINE void sample_cells(const float* const bending[], const std::int32_t* voxels, const float (*f)[most_lanes],
                               float (*components)[most_lanes][4]) {
  for (int lane = 0; lane < lanes; ++lane) {
    const float* const corner = bending[lane] + voxels[lane] * TensorBrick::bending_floats;
    const auto x = hn::Set(eight, f[0][lane]), y = hn::Set(eight, f[1][lane]), z = hn::Set(eight, f[2][lane]);
    alignas(32) float result[8];
    for (int i = 0; i < 8; i += eight_lanes) {
      const Polynomial<Eight> p = cell_polynomial(eight, corner + i);
      hn::Store(evaluate(p.k[0], p.k[1], p.k[2], p.k[3], p.k[4], p.k[5], p.k[6], p.k[7], x, y, z), eight, result + i);
    }
    std::memcpy(components[0][lane], result, 16);
    std::memcpy(components[1][lane], result + 4, 16);
  }
}

HWY_INLINE Tensor sample_own_cells(const Packet& packet, const std::int32_t* voxels, const F3& fraction) {
  alignas(64) float f[3][most_lanes];
  alignas(64) float components[2][most_lanes][4];
  store(fraction, f);
  sample_cells(packet.bending, voxels, f, components);
  Tensor T;
  hn::LoadInterleaved4(floats, components[0][0], T.c[0], T.c[1], T.c[2], T.c[3]);
  hn::LoadInterleaved4(floats, components[1][0], T.c[4], T.c[5], T.c[6], T.c[7]);
  return T;
}

/// The kernel, for voxels that are cubes along the axes (`uniform`) or any others.
template <bool uniform>
class Kernel {
 public:
  Kernel(const Medium& medium, std::vector<KernelRay>& rays) : medium_(medium), rays_(rays) {}

  std::uint64_t run();

 private:
  static constexpr int in_flight = 4;  // Packets that are stepped in turn: the processor works on several at once.

  bool fill(Packet& packet);
  void enter(Packet& packet, int lane);
  void visit_brick(Packet& packet, int lane);
  void repeat(Packet& packet, int lane, int of);
  void summarize(Packet& packet);
  void move_to_bricks(Packet& packet, const F3& point);
  Tensor sample(Packet& packet, const F3& offset);
  F3 bend(Packet& packet, const Tensor& T, const F3& v, F factor);
  F3 bend_strongly(Packet& packet, const Tensor& T, const F3& v, F factor);
  F3 index_direction(const F3& v) const;
  F step_time(Packet& packet, const F3& u);
  F3 take_step(Packet& packet, F time, F3& v, F3& u);
  void step(Packet& packet);
  std::uint32_t stopped(Packet& packet, const F3& to, const F3& v, F time, std::uint32_t& leaves) const;
  void take_out(Packet& packet, std::uint32_t stop, std::uint32_t leave);
  void repeat_one_alive(Packet& packet);
  float to_world() const { return uniform ? medium_.voxel : 1.0f; }  // Of what u is per.
  void land(Packet& packet);

  const Medium& medium_;
  const bool may_stop_ = std::isfinite(medium_.settings.max_length);  // Within the field, before the last step.
  std::vector<KernelRay>& rays_;
  std::size_t next_ = 0;  // The first ray that no packet has held yet.
  std::uint64_t samples_ = 0;
  Packet packets_[in_flight];
  Packet leaving_[in_flight];  // Rays of these that leave the extent, as before their last step.
};

/// Brings a ray into a lane.
template <bool uniform>
void Kernel<uniform>::enter(Packet& packet, int lane) {
  const KernelRay& ray = rays_[packet.ray[lane]];
  for (int axis = 0; axis < 3; ++axis) {
    packet.p[axis][lane] = ray.position[axis];
    packet.v[axis][lane] = ray.direction[axis];
    packet.u[axis][lane] = ray.direction[axis];
    packet.brick[lane][axis] = ray.brick[axis];
    packet.margin[axis][lane] = medium_.margin[axis];
  }
  packet.kick[lane] = uniform ? ray.flexibility * medium_.voxel : ray.flexibility;
  packet.norm[lane] = ray.norm;
  packet.length[lane] = 0;
  visit_brick(packet, lane);
}

/// Sets what depends on a lane's brick alone.
template <bool uniform>
void Kernel<uniform>::visit_brick(Packet& packet, int lane) {
  const std::int32_t* const at = packet.brick[lane];
  if (lane > 0 && packet.bending[lane - 1] && std::equal(at, at + 3, packet.brick[lane - 1])) {
    packet.bending[lane] = packet.bending[lane - 1];
    packet.strongest[lane] = packet.strongest[lane - 1];
  } else {
    const TensorBrick brick = medium_.brick(at);
    packet.bending[lane] = brick.bending;
    packet.strongest[lane] = brick.strongest;
  }
  const float longest = medium_.longest_step * (uniform ? 1.0f : medium_.longest_voxel);
  packet.reach[lane] = std::fabs(packet.kick[lane]) * longest * packet.strongest[lane];
  for (int axis = 0; axis < 3; ++axis) {
    packet.low[axis][lane] = static_cast<float>(medium_.first[axis] - TensorBrick::cells * at[axis]);
    packet.high[axis][lane] = static_cast<float>(medium_.last[axis] - TensorBrick::cells * at[axis]);
  }
}

/// Lets a lane repeat what another does.
template <bool uniform>
void Kernel<uniform>::repeat(Packet& packet, int lane, int of) {
  for (int axis = 0; axis < 3; ++axis) {
    packet.p[axis][lane] = packet.p[axis][of];
    packet.v[axis][lane] = packet.v[axis][of];
    packet.u[axis][lane] = packet.u[axis][of];
    packet.low[axis][lane] = packet.low[axis][of];
    packet.high[axis][lane] = packet.high[axis][of];
    packet.margin[axis][lane] = packet.margin[axis][of];
    packet.brick[lane][axis] = packet.brick[of][axis];
  }
  packet.kick[lane] = packet.kick[of];
  packet.length[lane] = packet.length[of];
  packet.norm[lane] = packet.norm[of];
  packet.reach[lane] = packet.reach[of];
  packet.strongest[lane] = packet.strongest[of];
  packet.time[lane] = packet.time[of];
  packet.bending[lane] = packet.bending[of];
  packet.ray[lane] = packet.ray[of];
}

/// Sets what depends on all lanes' bricks.
template <bool uniform>
void Kernel<uniform>::summarize(Packet& packet) {
  packet.one_brick = true;
  packet.near_border = packet.near_surface = packet.straight = false;
  packet.greatest_reach = 0;
  const float margin = medium_.longest_step + 1;  // A step may begin a little outside of its brick.
  for (int lane = 0; lane < lanes; ++lane) {
    packet.one_brick &= packet.bending[lane] == packet.bending[0];
    packet.straight |= packet.strongest[lane] == 0;
    packet.greatest_reach =
        packet.reach[lane] <= packet.greatest_reach ? packet.greatest_reach : packet.reach[lane];  // Keeps NaN.
    for (int axis = 0; axis < 3; ++axis)
      packet.near_border |= packet.low[axis][lane] > -margin || packet.high[axis][lane] < TensorBrick::cells + margin;
    packet.near_surface |= medium_.near_surface(packet.brick[lane]);
  }
  if (packet.greatest_reach <= strongest_kick) std::fill_n(packet.norm, lanes, 0.0f);  // No step need be shorter here.
}

template <bool uniform>
bool Kernel<uniform>::fill(Packet& packet) {
  if (next_ == rays_.size()) return false;
  packet.alive = 0;
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
  store(index_direction(load(packet.v)), packet.u);
  summarize(packet);
  return true;
}

/// Rebases the lanes whose point has left their brick.
template <bool uniform>
HWY_NOINLINE void Kernel<uniform>::move_to_bricks(Packet& packet, const F3& point) {
  alignas(64) float at[3][most_lanes];
  store(point, at);
  for (int lane = 0; lane < lanes; ++lane) {
    bool moved = false;
    for (int axis = 0; axis < 3; ++axis) {
      // The cell between the last two voxels is the last one, also for points on its far face.
      const float cell =
          std::min(std::floor(at[axis][lane]), std::max(packet.high[axis][lane] - 1, packet.low[axis][lane]));
      const float bricks = std::floor(cell / TensorBrick::cells);
      if (bricks == 0) continue;
      moved = true;
      packet.brick[lane][axis] += static_cast<std::int32_t>(bricks);
      packet.p[axis][lane] -= TensorBrick::cells * bricks;
    }
    if (moved) visit_brick(packet, lane);
  }
  summarize(packet);
}

template <bool uniform>
HWY_INLINE F3 Kernel<uniform>::index_direction(const F3& v) const {
  if constexpr (uniform) return v;
  const auto& m = medium_.to_index;
  const auto row = [&](int i) HWY_ATTR {
    return hn::MulAdd(set(m[i][0]), v.x, hn::MulAdd(set(m[i][1]), v.y, hn::Mul(set(m[i][2]), v.z)));
  };
  return {row(0), row(1), row(2)};
}

HWY_INLINE F3 clamp(const F3& p, const F3& low, const F3& high) {
  return {hn::Min(hn::Max(p.x, low.x), high.x), hn::Min(hn::Max(p.y, low.y), high.y),
          hn::Min(hn::Max(p.z, low.z), high.z)};
}

/// The tensor at the packet's positions plus `offset`. Takes lanes to the bricks of these points.
template <bool uniform>
HWY_INLINE Tensor Kernel<uniform>::sample(Packet& packet, const F3& offset) {
  F3 point, near;
  F voxel;
  for (bool again = false;; again = true) {
    point = add(load(packet.p), offset);
    if (HWY_UNLIKELY(packet.near_border)) point = clamp(point, load(packet.low), load(packet.high));
    near = {hn::Floor(point.x), hn::Floor(point.y), hn::Floor(point.z)};
    if (HWY_UNLIKELY(packet.near_border)) {
      const F3 low = load(packet.low), high = load(packet.high);
      const F one = set(1);
      near = {hn::Min(near.x, hn::Max(hn::Sub(high.x, one), low.x)),
              hn::Min(near.y, hn::Max(hn::Sub(high.y, one), low.y)),
              hn::Min(near.z, hn::Max(hn::Sub(high.z, one), low.z))};
    }
    // As unsigned integers, negative floats are the greatest.
    const auto greatest =
        hn::Max(hn::Max(hn::BitCast(bits, near.x), hn::BitCast(bits, near.y)), hn::BitCast(bits, near.z));
    const auto outside = hn::Gt(greatest, hn::BitCast(bits, set(TensorBrick::cells - 1)));
    if (HWY_LIKELY(hn::AllFalse(bits, outside))) break;
    if (again) {  // Rounding took a point onto its new brick's face.
      const F zero = hn::Zero(floats), last = set(TensorBrick::cells - 1);
      near = clamp(near, {zero, zero, zero}, {last, last, last});
      break;
    }
    move_to_bricks(packet, point);
  }
  const F3 f{hn::Sub(point.x, near.x), hn::Sub(point.y, near.y), hn::Sub(point.z, near.z)};
  const F width = set(TensorBrick::width);
  voxel = hn::MulAdd(hn::MulAdd(near.x, width, near.y), width, near.z);
  const float first = hn::GetLane(voxel);
  if (HWY_LIKELY(packet.one_brick && hn::AllTrue(floats, hn::Eq(voxel, set(first)))))
    return sample_one_cell(packet.bending[0] + static_cast<int>(first) * TensorBrick::bending_floats, f);
  alignas(64) std::int32_t voxels[most_lanes];
  hn::Store(hn::ConvertTo(ints, voxel), ints, voxels);
  return sample_own_cells(packet, voxels, f);
}

/// exp(factor · T) V, normalised, where ‖factor · T‖ is small in all lanes: two terms, and the square root as a series.
HWY_INLINE F3 bend_weakly(const Tensor& T, const F3& v, F factor) {
  const F3 first = mul(factor, apply(T, v));
  const F3 second = apply(T, first);
  const F3 sum = mul_add(hn::Mul(set(0.5f), factor), second, add(v, first));
  const F e = hn::Sub(dot(sum, sum), set(1));
  const F series = hn::MulAdd(hn::MulAdd(set(-5.0f / 16), e, set(3.0f / 8)), e, set(-0.5f));
  return mul(hn::MulAdd(series, e, set(1)), sum);
}

/// The Frobenius norm of T's deviator.
HWY_INLINE F deviator_norm(const Tensor& T) {
  F squares = hn::Mul(T.c[0], T.c[0]);
  for (int i = 1; i < 8; ++i) squares = hn::MulAdd(T.c[i], T.c[i], squares);
  const F trace = hn::Add(T.c[0], T.c[4]);
  return hn::Sqrt(hn::Max(hn::NegMulAdd(hn::Mul(trace, trace), set(1.0f / 3), squares), hn::Zero(floats)));
}

template <bool uniform>
HWY_INLINE F3 Kernel<uniform>::bend(Packet& packet, const Tensor& T, const F3& v, F factor) {
  if (HWY_LIKELY(packet.greatest_reach <= series_reach[0])) return bend_weakly(T, v, factor);
  return bend_strongly(packet, T, v, factor);
}

/// The same for any strength. Which lane is computed how depends on that lane alone.
template <bool uniform>
HWY_INLINE F3 Kernel<uniform>::bend_strongly(Packet& packet, const Tensor& T, const F3& v, F factor) {
  const F reach = hn::Load(floats, packet.reach);
  F size = reach;
  if (HWY_UNLIKELY(!(packet.greatest_reach <= strongest_kick))) {
    const F norm = deviator_norm(T);
    hn::Store(norm, floats, packet.norm);
    size = hn::IfThenElse(hn::Le(reach, set(strongest_kick)), reach, hn::Mul(norm, hn::Abs(factor)));
  }
  F3 term = mul(factor, apply(T, v));
  F3 sum = add(v, term);
  term = mul(hn::Mul(set(0.5f), factor), apply(T, term));
  sum = add(sum, term);
  for (int n = 3; n <= most_terms; ++n) {
    const Mask needed = hn::Gt(size, set(series_reach[n - 3]));
    if (hn::AllFalse(floats, needed)) break;
    term = mul(hn::Mul(set(1.0f / static_cast<float>(n)), factor), apply(T, term));
    const F zero = hn::Zero(floats);
    sum = add(sum, select(needed, term, {zero, zero, zero}));
  }
  const F squared = dot(sum, sum), e = hn::Sub(squared, set(1));
  const F series = hn::MulAdd(hn::MulAdd(set(-5.0f / 16), e, set(3.0f / 8)), e, set(-0.5f));
  const F exact = hn::Div(set(1), hn::Sqrt(squared));
  const Mask weak = hn::Le(size, set(series_reach[0]));
  F3 result = mul(hn::IfThenElse(weak, hn::MulAdd(series, e, set(1)), exact), sum);

  const Mask fits = hn::Le(size, set(1));
  if (HWY_LIKELY(hn::AllTrue(floats, fits))) return result;
  const std::uint32_t too_strong = ~to_bits(fits);
  alignas(64) float all[8][most_lanes], factors[most_lanes], from[3][most_lanes], to[3][most_lanes];
  for (int i = 0; i < 8; ++i) hn::Store(T.c[i], floats, all[i]);
  hn::Store(factor, floats, factors);
  store(v, from);
  store(result, to);
  for (int lane = 0; lane < lanes; ++lane) {
    if (!(too_strong >> lane & 1)) continue;
    float one[8], direction[3] = {from[0][lane], from[1][lane], from[2][lane]};
    for (int i = 0; i < 8; ++i) one[i] = all[i][lane];
    Medium::exponential(one, factors[lane], direction);
    for (int axis = 0; axis < 3; ++axis) to[axis][lane] = direction[axis];
  }
  return load(to);
}

/// How long the next step is, in the units that u is per: voxels, or, if voxels are not uniform, world units.
template <bool uniform>
HWY_INLINE F Kernel<uniform>::step_time(Packet& packet, const F3& u) {
  const F voxel = uniform ? set(1) : hn::Div(set(1), hn::Sqrt(dot(u, u)));
  const bool automatic = medium_.settings.step == 0;
  F steps = set(medium_.longest_step);
  if (HWY_UNLIKELY(automatic && !(packet.greatest_reach <= strongest_kick))) {
    const F kick = hn::Mul(hn::Mul(hn::Abs(hn::Load(floats, packet.kick)), hn::Load(floats, packet.norm)), voxel);
    const F shorter = hn::Max(hn::Div(set(strongest_kick), kick), set(shortest_automatic_step));
    steps = hn::IfThenElse(hn::Gt(hn::Mul(kick, set(longest_automatic_step)), set(strongest_kick)), shorter, steps);
  }
  F time = uniform ? steps : hn::Mul(steps, voxel);
  if (HWY_UNLIKELY(packet.straight)) {
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

/// A step from the packet's positions. Sets the directions at its end. @return the positions.
template <bool uniform>
HWY_INLINE F3 Kernel<uniform>::take_step(Packet& packet, F time, F3& v, F3& u) {
  const F half = hn::Mul(set(0.5f), time);
  const F3 offset = mul(half, load(packet.u));
  const Tensor T = sample(packet, offset);
  v = bend(packet, T, load(packet.v), hn::Mul(time, hn::Load(floats, packet.kick)));
  u = index_direction(v);
  return mul_add(half, u, add(load(packet.p), offset));
}

/// The lanes that cannot take this step, as bits; `leaves` those of them that leave the extent by it.
template <bool uniform>
HWY_NOINLINE std::uint32_t Kernel<uniform>::stopped(Packet& packet, const F3& to, const F3& v, F time,
                                                    std::uint32_t& leaves) const {
  const auto outside = [&](F x, int axis) HWY_ATTR {
    const F margin = hn::Load(floats, packet.margin[axis]);
    return hn::Or(hn::Lt(x, hn::Sub(hn::Load(floats, packet.low[axis]), margin)),
                  hn::Gt(x, hn::Add(hn::Load(floats, packet.high[axis]), margin)));
  };
  leaves = to_bits(hn::Or(hn::Or(outside(to.x, 0), outside(to.y, 1)), outside(to.z, 2)));
  const F unit = dot(v, v);
  std::uint32_t stop = to_bits(hn::Or(hn::Lt(unit, set(0.5f)), hn::Ne(unit, unit)));  // No direction to go in.
  const F length = hn::Mul(hn::Add(hn::Load(floats, packet.length), time), set(to_world()));
  stop |= to_bits(hn::Ge(length, set(medium_.settings.max_length)));
  if (packet.near_surface) {
    alignas(64) float ends[3][most_lanes];
    store(to, ends);
    for (int lane = 0; lane < lanes; ++lane) {
      if (!(packet.alive >> lane & 1)) continue;
      double from[3], until[3];
      for (int axis = 0; axis < 3; ++axis) {
        const double base = double{TensorBrick::cells} * packet.brick[lane][axis];
        from[axis] = base + packet.p[axis][lane];
        until[axis] = base + ends[axis][lane];
      }
      if (medium_.meets_surface(from, until)) stop |= 1u << lane;
    }
  }
  leaves &= ~stop & packet.alive;
  return stop & packet.alive;
}

/// Hands the rays of some lanes on, as they are before the step.
template <bool uniform>
HWY_NOINLINE void Kernel<uniform>::take_out(Packet& packet, std::uint32_t stop, std::uint32_t leave) {
  Packet& leaving = leaving_[&packet - packets_];
  for (int lane = 0; lane < lanes; ++lane) {
    if (!((stop | leave) >> lane & 1)) continue;
    KernelRay& ray = rays_[packet.ray[lane]];
    for (int axis = 0; axis < 3; ++axis) {
      ray.brick[axis] = packet.brick[lane][axis];
      ray.position[axis] = packet.p[axis][lane];
      ray.direction[axis] = packet.v[axis][lane];
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
      leaving.brick[lane][axis] = packet.brick[lane][axis];
      leaving.margin[axis][lane] = packet.margin[axis][lane];
    }
    leaving.kick[lane] = packet.kick[lane];
    leaving.time[lane] = packet.time[lane];
    leaving.ray[lane] = packet.ray[lane];
    visit_brick(leaving, lane);
    leaving.alive |= 1u << lane;
  }
}

template <bool uniform>
void Kernel<uniform>::repeat_one_alive(Packet& packet) {
  const int of = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(packet.alive));
  for (int lane = 0; lane < lanes; ++lane)
    if (!(packet.alive >> lane & 1)) repeat(packet, lane, of);
  summarize(packet);
}

template <bool uniform>
HWY_INLINE void Kernel<uniform>::step(Packet& packet) {
  if (HWY_UNLIKELY(packet.steps >= packet.most_steps)) return take_out(packet, packet.alive, 0);
  const F time = step_time(packet, load(packet.u));
  F3 v, u;
  const F3 to = take_step(packet, time, v, u);
  samples_ += hwy::PopCount(packet.alive);
  std::uint32_t leave = 0, stop = 0;
  if (HWY_UNLIKELY(packet.near_border || packet.near_surface || may_stop_ ||
                   !(packet.greatest_reach <= strongest_kick))) {
    hn::Store(time, floats, packet.time);
    stop = stopped(packet, to, v, time, leave);
    if (HWY_UNLIKELY((stop | leave) != 0)) take_out(packet, stop, leave);
  }
  store(to, packet.p);
  store(v, packet.v);
  if constexpr (!uniform) store(u, packet.u);
  hn::Store(hn::Add(hn::Load(floats, packet.length), time), floats, packet.length);
  ++packet.steps;
  if (HWY_UNLIKELY((stop | leave) != 0) && packet.alive != 0) repeat_one_alive(packet);
}

/// The step that leaves the extent, repeated with the length that ends on its face (Newton's method).
template <bool uniform>
HWY_NOINLINE void Kernel<uniform>::land(Packet& packet) {
  repeat_one_alive(packet);
  const F zero = hn::Zero(floats), one = set(1), longest = hn::Load(floats, packet.time);
  F3 v, u;
  F3 to = take_step(packet, longest, v, u);
  const F3 from = load(packet.p), chord{hn::Sub(to.x, from.x), hn::Sub(to.y, from.y), hn::Sub(to.z, from.z)};
  const auto face = [&](F along, int axis) HWY_ATTR {
    const F margin = hn::Load(floats, packet.margin[axis]);
    return hn::IfThenElse(hn::Gt(along, zero), hn::Add(hn::Load(floats, packet.high[axis]), margin),
                          hn::Sub(hn::Load(floats, packet.low[axis]), margin));
  };
  const auto part = [&](F p, F along, int axis) HWY_ATTR {
    const F gap = hn::Sub(face(along, axis), p);
    return hn::IfThenElse(hn::Lt(hn::Abs(gap), hn::Abs(along)), hn::Div(gap, along), one);
  };
  const F x = part(from.x, chord.x, 0), y = part(from.y, chord.y, 1), z = part(from.z, chord.z, 2);
  const F nearest = hn::Min(hn::Min(x, y), z);
  const Mask is_x = hn::Eq(x, nearest), is_y = hn::Eq(y, nearest);
  const auto of_axis = [&](F a, F b, F c) HWY_ATTR { return hn::IfThenElse(is_x, a, hn::IfThenElse(is_y, b, c)); };
  F time = hn::Mul(longest, hn::Max(nearest, zero));
  for (int i = 0; i < 3; ++i) {
    to = take_step(packet, time, v, u);  // Which may take the packet to another brick.
    const F gap = hn::Sub(of_axis(face(chord.x, 0), face(chord.y, 1), face(chord.z, 2)), of_axis(to.x, to.y, to.z));
    F rest = hn::Div(gap, of_axis(u.x, u.y, u.z));
    rest = hn::IfThenElseZero(hn::Le(hn::Abs(rest), longest), rest);  // But of light that grazes the face.
    if (i == 2) {
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
      ray.brick[axis] = packet.brick[lane][axis];
      ray.position[axis] = packet.p[axis][lane];
      ray.direction[axis] = packet.v[axis][lane];
    }
    ray.axis = static_cast<std::int8_t>(on_x >> lane & 1 ? 0 : on_y >> lane & 1 ? 1 : 2);
    ray.length += double{packet.time[lane]} * to_world();
    ++ray.steps;
    samples_ += 4;
  }
  packet.alive = 0;
}

template <bool uniform>
std::uint64_t Kernel<uniform>::run() {
  for (Packet& packet : packets_) fill(packet);
  for (bool busy = true; busy;) {
    busy = false;
    for (int i = 0; i < in_flight; ++i) {
      Packet& packet = packets_[i];
      if (packet.alive == 0) continue;
      step(packet);
      busy = true;
      if (HWY_LIKELY(packet.alive != 0)) continue;
      if (leaving_[i].alive != 0) land(leaving_[i]);
      fill(packet);
    }
  }
  return samples_;
}

std::uint64_t trace(const Medium& medium, std::vector<KernelRay>& rays) {
  return medium.uniform ? Kernel<true>(medium, rays).run() : Kernel<false>(medium, rays).run();
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

Medium::Medium(const TensorField& field_, const KernelSettings& settings_) : field(field_), settings(settings_) {
  const Eigen::Matrix3d M = field.to_index().linear();
  uniform = M == Eigen::Matrix3d(M(0, 0) * Eigen::Matrix3d::Identity()) && M(0, 0) > 0;
  voxel = static_cast<float>(1 / M(0, 0));
  const Eigen::Matrix3d to_world = field.to_world().linear();
  longest_voxel = static_cast<float>(to_world.norm());  // Not less than the greatest singular value.
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) to_index[row][column] = static_cast<float>(M(row, column));
  for (int axis = 0; axis < 3; ++axis) {
    first[axis] = static_cast<std::int32_t>(field.voxels().min()[axis]);
    last[axis] = static_cast<std::int32_t>(field.voxels().max()[axis]);
    margin[axis] = static_cast<float>(field.index_bounds().max()[axis] - field.voxels().max()[axis]);
  }
  longest_step = settings.step > 0 ? settings.step : longest_automatic_step;
}

bool Medium::near_surface(const std::int32_t at[3]) const {
  if (!settings.meets_surface) return false;
  const Eigen::Vector3d first_voxel = TensorBrick::cells * Eigen::Vector3d(at[0], at[1], at[2]);
  const Eigen::Vector3d margin_around = Eigen::Vector3d::Constant(longest_step + 1);
  return settings.surfaces.intersects(
      {first_voxel - margin_around, first_voxel + Eigen::Vector3d::Constant(TensorBrick::cells) + margin_around});
}

bool Medium::meets_surface(const double from[3], const double to[3]) const {
  return settings.meets_surface(field.to_world() * Eigen::Vector3d(from[0], from[1], from[2]),
                                field.to_world() * Eigen::Vector3d(to[0], to[1], to[2]));
}

void Medium::exponential(const float T[8], float factor, float V[3]) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 8; ++i) A.data()[i] = double{factor} * T[i];
  const Eigen::Vector3d to = exponential_direction(A, {V[0], V[1], V[2]});
  for (int axis = 0; axis < 3; ++axis) V[axis] = static_cast<float>(to[axis]);
}

bool has_kernel(BendingMethod method) { return method == BendingMethod::splitting; }

std::uint64_t run(const TensorField& field, const KernelSettings& settings, std::vector<KernelRay>& rays) {
  const Medium medium(field, settings);
  const WithoutDenormals guard;
  return HWY_DYNAMIC_DISPATCH(trace)(medium, rays);
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
