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
#include <hwy/cache_control.h>
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
  bool flat;                       // Whether an axis has a single voxel.
  float slope[3];                  // 0 along those axes, 1 along the others.
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
constexpr int landing_steps = 4;  // Of Newton's method, to a face of the extent.

/// With n terms the power series of exp(A) V is exact to 3e-9 for ‖A‖ up to entry n − 2: (3e-9 (n + 1)!)^(1/(n + 1)).
/// That is less than rounding, as the error is the same in every step where rounding is not.
constexpr float series_reach[] = {0.00262f, 0.0164f, 0.0514f, 0.1137f, 0.205f,
                                  0.3238f,  0.4688f, 0.6364f, 0.8246f, 1.03f};
constexpr int most_terms = 11;

/// Rays side by side, one a lane. All lanes hold a ray: those whose ray has ended repeat that of another, so that no
/// step needs a mask.
struct Packet {
  alignas(64) float p[3][most_lanes];          // Position, voxels from the brick's first.
  alignas(64) float v[3][most_lanes];          // V.
  alignas(64) float u[3][most_lanes];          // The direction in index space; unused if voxels are uniform: it is V.
  alignas(64) float kick[most_lanes];          // s, times the voxel's edge if voxels are uniform.
  alignas(64) float length[most_lanes];        // Of the way since the ray came, in units of the time that u is per.
  alignas(64) float bending_rate[most_lanes];  // s times the norm of T's deviator as last sampled, or 0.
  alignas(64) float reach[most_lanes];         // Bound on ‖s h T‖ in the brick.
  alignas(64) float strongest[most_lanes];
  alignas(64) float low[3][most_lanes], high[3][most_lanes];  // The voxels' box, relative to the brick.
  alignas(64) float last[3][most_lanes];                      // The last cell, likewise.

  // Of the step being taken:
  alignas(64) float time[most_lanes];              // In units of what u is per.
  alignas(64) float middle[3][most_lanes];         // Positions there ...
  alignas(64) float fraction[3][most_lanes];       // ... and within the cell;
  alignas(64) float polynomial[8][8];              // the cell's, if it is one_cell,
  alignas(64) float components[2][most_lanes][4];  // or each lane's tensor;
  alignas(64) float tensor[8][most_lanes];         // the same, lanes side by side.

  // Only of rays with differentials: p and v along two parameters, now, in the middle of the step and after it, the
  // slopes of the tensor along x, y and z, and ‖s h T‖ or a bound on it.
  alignas(64) float dp[2][3][most_lanes], dv[2][3][most_lanes], dmiddle[2][3][most_lanes];
  alignas(64) float dp_next[2][3][most_lanes], dv_next[2][3][most_lanes];
  alignas(64) float slope_components[3][2][most_lanes][4], slopes[3][8][most_lanes];
  alignas(64) float size[most_lanes];

  const float* bending[most_lanes] = {};
  alignas(64) std::int32_t brick[3][most_lanes];
  std::int32_t ray[most_lanes];
  std::uint32_t alive = 0;  // A bit each.
  std::uint32_t steps = 0, most_steps = 0;
  float greatest_reach = 0;
  bool one_brick = false, near_border = false, near_surface = false, straight = false, one_cell = false;
  bool clamps = false;  // Whether points beyond the voxels' box are taken to it.
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

/// A value and its slopes.
template <class V>
struct Slopes {
  V value, x, y, z;
};

/// The same with the slopes: 11 operations.
template <class V>
HWY_INLINE Slopes<V> evaluate_slopes(V k0, V kz, V ky, V kyz, V kx, V kxz, V kxy, V kxyz, V x, V y, V z) {
  const V near_y = hn::MulAdd(kyz, z, ky), far_y = hn::MulAdd(kxyz, z, kxy);
  const V near = hn::MulAdd(near_y, y, hn::MulAdd(kz, z, k0)), far = hn::MulAdd(far_y, y, hn::MulAdd(kxz, z, kx));
  return {hn::MulAdd(far, x, near), far, hn::MulAdd(far_y, x, near_y),
          hn::MulAdd(hn::MulAdd(kxyz, y, kxz), x, hn::MulAdd(kyz, y, kz))};
}

using Eight = hn::CappedTag<float, 8>;  // For the components of one voxel.
constexpr Eight eight;
constexpr int eight_lanes = static_cast<int>(hn::MaxLanes(Eight()));

/// All lanes are in one cell: its polynomial is made once, and its coefficients go to all lanes.
HWY_INLINE void make_polynomial(const float* corner, float (&k)[8][8]) {
  for (int i = 0; i < 8; i += eight_lanes) {
    const Polynomial<Eight> polynomial = cell_polynomial(eight, corner + i);
    for (int j = 0; j < 8; ++j) hn::Store(polynomial.k[j], eight, &k[j][i]);
  }
}

HWY_INLINE F evaluate_polynomial(const float (&k)[8][8], int i, const F3& f) {
  return evaluate(set(k[0][i]), set(k[1][i]), set(k[2][i]), set(k[3][i]), set(k[4][i]), set(k[5][i]), set(k[6][i]),
                  set(k[7][i]), f.x, f.y, f.z);
}

HWY_INLINE Slopes<F> polynomial_slopes(const float (&k)[8][8], int i, const F3& f) {
  return evaluate_slopes(set(k[0][i]), set(k[1][i]), set(k[2][i]), set(k[3][i]), set(k[4][i]), set(k[5][i]),
                         set(k[6][i]), set(k[7][i]), f.x, f.y, f.z);
}

/// Components of one lane: the first four of each lane, and the last four.
template <class V>
HWY_INLINE void store_components(V values, int i, int lane, float (*components)[most_lanes][4]) {
  alignas(32) float eight_values[8];
  hn::Store(values, eight, eight_values);
  for (int j = 0; j < eight_lanes; j += 4) std::memcpy(components[(i + j) / 4][lane], eight_values + j, 16);
}

/// Lanes are in several cells: a vector holds the components of one lane at a time.
template <bool differentials>
HWY_NOINLINE void sample_own_cells(Packet& packet, const std::int32_t* voxels) {
  for (int i = 0; i < 8; i += eight_lanes) {
    for (int lane = 0; lane < lanes; ++lane) {
      const float* const corner = packet.bending[lane] + voxels[lane] * TensorBrick::bending_floats + i;
      const Polynomial<Eight> p = cell_polynomial(eight, corner);
      const auto x = hn::Set(eight, packet.fraction[0][lane]), y = hn::Set(eight, packet.fraction[1][lane]),
                 z = hn::Set(eight, packet.fraction[2][lane]);
      if constexpr (differentials) {
        const auto at = evaluate_slopes(p.k[0], p.k[1], p.k[2], p.k[3], p.k[4], p.k[5], p.k[6], p.k[7], x, y, z);
        store_components(at.value, i, lane, packet.components);
        store_components(at.x, i, lane, packet.slope_components[0]);
        store_components(at.y, i, lane, packet.slope_components[1]);
        store_components(at.z, i, lane, packet.slope_components[2]);
      } else {
        store_components(evaluate(p.k[0], p.k[1], p.k[2], p.k[3], p.k[4], p.k[5], p.k[6], p.k[7], x, y, z), i, lane,
                         packet.components);
      }
    }
  }
}

/// From lane after lane to component after component.
HWY_INLINE void transpose(const float (&components)[2][most_lanes][4], float (&tensor)[8][most_lanes]) {
  for (int half = 0; half < 2; ++half) {
    F a, b, c, d;
    hn::LoadInterleaved4(floats, components[half][0], a, b, c, d);
    hn::Store(a, floats, tensor[4 * half]);
    hn::Store(b, floats, tensor[4 * half + 1]);
    hn::Store(c, floats, tensor[4 * half + 2]);
    hn::Store(d, floats, tensor[4 * half + 3]);
  }
}

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
  void begin(Packet& packet);
  void find_bricks(Packet& packet, std::uint32_t wanted);
  void repeat(Packet& packet, int lane, int of);
  void summarize(Packet& packet);
  void move_to_bricks(Packet& packet, const F3& point);
  void prefetch(const Packet& packet, const F3& point);
  void locate(Packet& packet, F time);
  void interpolate(Packet& packet);
  F3 bend(Packet& packet, const Tensor& T, const F3& v, F factor);
  F3 bend_strongly(Packet& packet, const Tensor& T, const F3& v, F factor);
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

/// Finds the bricks of some lanes, given as bits.
template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::find_bricks(Packet& packet, std::uint32_t wanted) {
  const auto x = hn::Load(ints, packet.brick[0]), y = hn::Load(ints, packet.brick[1]),
             z = hn::Load(ints, packet.brick[2]);
  while (wanted != 0) {
    const auto first = hwy::Num0BitsBelowLS1Bit_Nonzero32(wanted);
    const std::int32_t at[3] = {packet.brick[0][first], packet.brick[1][first], packet.brick[2][first]};
    const TensorBrick brick = medium_.brick(at);
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
template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::summarize(Packet& packet) {
  const F strongest = hn::Load(floats, packet.strongest), most = set(1e30f);
  const float longest = medium_.longest_step * (uniform ? 1.0f : medium_.longest_voxel);
  const F reach = hn::Mul(hn::Mul(hn::Abs(hn::Load(floats, packet.kick)), set(longest)), strongest);
  hn::Store(reach, floats, packet.reach);
  packet.greatest_reach =
      hn::AllTrue(floats, hn::Le(reach, most)) ? hn::GetLane(hn::MaxOfLanes(floats, reach)) : 1e30f;  // NaN is strong.
  packet.straight = !hn::AllFalse(floats, hn::Eq(strongest, hn::Zero(floats)));
  if (packet.greatest_reach <= strongest_kick)
    hn::Store(hn::Zero(floats), floats, packet.bending_rate);  // Steps stay long.

  // A step may begin a little outside of its brick.
  const F near = set(-medium_.longest_step - 1), far = set(TensorBrick::cells + medium_.longest_step + 1);
  Mask border = hn::Gt(hn::Load(floats, packet.low[0]), near), apart = hn::Lt(near, near);
  for (int axis = 0; axis < 3; ++axis) {
    const auto brick = hn::Load(ints, packet.brick[axis]);
    apart = hn::Or(apart, hn::RebindMask(floats, hn::Ne(brick, hn::Set(ints, packet.brick[axis][0]))));
    border = hn::Or(border, hn::Or(hn::Gt(hn::Load(floats, packet.low[axis]), near),
                                   hn::Lt(hn::Load(floats, packet.high[axis]), far)));
  }
  packet.one_brick = hn::AllFalse(floats, apart);
  packet.near_border = !hn::AllFalse(floats, border);
  if (!medium_.settings.meets_surface) return;
  packet.near_surface = false;
  for (int lane = 0; lane < lanes; ++lane) {
    const std::int32_t at[3] = {packet.brick[0][lane], packet.brick[1][lane], packet.brick[2][lane]};
    packet.near_surface |= medium_.near_surface(at);
  }
}

/// After lanes have been set: what follows from their rays.
template <bool uniform, bool differentials>
void Kernel<uniform, differentials>::begin(Packet& packet) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto base = hn::Mul(hn::Load(ints, packet.brick[axis]), hn::Set(ints, TensorBrick::cells));
    const F low = hn::ConvertTo(floats, hn::Sub(hn::Set(ints, medium_.first[axis]), base));
    const F high = hn::ConvertTo(floats, hn::Sub(hn::Set(ints, medium_.last[axis]), base));
    hn::Store(low, floats, packet.low[axis]);
    hn::Store(high, floats, packet.high[axis]);
    hn::Store(hn::Max(hn::Sub(high, set(1)), low), floats, packet.last[axis]);
  }
  find_bricks(packet, (1u << lanes) - 1);
  summarize(packet);
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
  begin(packet);
  return true;
}

/// Takes the lanes whose point has left their brick to the point's.
template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::move_to_bricks(Packet& packet, const F3& point) {
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
  find_bricks(packet, to_bits(moved));
  summarize(packet);
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

HWY_INLINE F3 clamp(const F3& p, const F3& low, const F3& high) {
  return {hn::Min(hn::Max(p.x, low.x), high.x), hn::Min(hn::Max(p.y, low.y), high.y),
          hn::Min(hn::Max(p.z, low.z), high.z)};
}

/// Asks for the memory of a cell.
HWY_INLINE void prefetch_cell(const float* corner) {
  constexpr int z = TensorBrick::bending_floats, y = TensorBrick::width * z, x = TensorBrick::width * y;
  for (const int edge : {0, y, x, x + y}) {
    hwy::Prefetch(corner + edge);
    hwy::Prefetch(corner + edge + z);
  }
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
    move_to_bricks(packet, point);
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

/// exp(factor · T) V, normalised, where ‖factor · T‖ is small in all lanes: two terms, and the square root as a series.
HWY_INLINE F3 bend_weakly(const Tensor& T, const F3& v, F factor) {
  const F3 first = mul(factor, apply(T, v));
  const F3 second = apply(T, first);
  const F3 sum = mul_add(hn::Mul(set(0.5f), factor), second, add(v, first));
  const F e = hn::Sub(dot(sum, sum), set(1));
  const F series = hn::MulAdd(hn::MulAdd(set(-5.0f / 16), e, set(3.0f / 8)), e, set(-0.5f));
  return mul(hn::MulAdd(series, e, set(1)), sum);
}

/// The Frobenius norm of the deviator of factor · T. T itself may be too large, or too small, for its square.
HWY_INLINE F deviator_norm(const Tensor& T, F factor) {
  F squares = hn::Zero(floats);
  for (int i = 0; i < 8; ++i) {
    const F scaled = hn::Mul(factor, T.c[i]);
    squares = hn::MulAdd(scaled, scaled, squares);
  }
  const F trace = hn::Mul(factor, hn::Add(T.c[0], T.c[4]));
  const F deviator = hn::Max(hn::NegMulAdd(hn::Mul(trace, trace), set(1.0f / 3), squares), hn::Zero(floats));
  return hn::Sqrt(hn::IfThenElse(hn::Le(squares, set(1e38f)), deviator, squares));  // Infinity stays what it is.
}

template <bool uniform, bool differentials>
HWY_INLINE F3 Kernel<uniform, differentials>::bend(Packet& packet, const Tensor& T, const F3& v, F factor) {
  if (HWY_LIKELY(packet.greatest_reach <= series_reach[0])) {
    if constexpr (differentials) hn::Store(hn::Load(floats, packet.reach), floats, packet.size);
    return bend_weakly(T, v, factor);
  }
  return bend_strongly(packet, T, v, factor);
}

/// The same for any strength. Which lane is computed how depends on that lane alone.
template <bool uniform, bool differentials>
HWY_INLINE F3 Kernel<uniform, differentials>::bend_strongly(Packet& packet, const Tensor& T, const F3& v, F factor) {
  const F reach = hn::Load(floats, packet.reach);
  F size = reach;
  if (HWY_UNLIKELY(!(packet.greatest_reach <= strongest_kick))) {
    const F norm = deviator_norm(T, factor), time = hn::Max(hn::Load(floats, packet.time), set(1e-30f));
    hn::Store(hn::Div(norm, time), floats, packet.bending_rate);
    size = hn::IfThenElse(hn::Le(reach, set(strongest_kick)), reach, norm);
  }
  if constexpr (differentials) hn::Store(size, floats, packet.size);
  const F3 first = mul(factor, apply(T, v)), second = apply(T, first);
  const F half = hn::Mul(set(0.5f), factor);
  F3 sum = mul_add(half, second, add(v, first)), term = mul(half, second);
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
  if constexpr (differentials) {  // Those rays stop here.
    const F zero = hn::Zero(floats);
    return select(fits, result, {zero, zero, zero});
  }
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
    move_to_bricks(packet, select(moves, clamp(p, load(packet.low), load(packet.high)), {zero, zero, zero}));
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
  v = bend(packet, T, load(packet.v), factor);
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
  begin(packet);
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
    slope[axis] = field.voxels().sizes()[axis] > 0 ? 1.0f : 0.0f;
    margin[axis] = static_cast<float>(field.index_bounds().max()[axis] - field.voxels().max()[axis]);
  }
  flat = (field.voxels().sizes().array() == 0).any();
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
