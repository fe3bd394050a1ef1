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
  // Packets that are stepped in turn: as many vectors as the processor needs to have work while one waits for another.
  static constexpr int in_flight = lanes > 8 ? 2 : 1;

  bool fill(Packet& packet);
  void enter(Packet& packet, int lane);
  static void copy_lane(const Packet& from, int of, Packet& to, int lane);
  void close_ranks(Packet& packet);
  F3 index_direction(const F3& v) const;
  void leave_straight_bricks(Packet& packet);
  void find_times(Packet& packet);
  template <bool careful>
  bool find_cells(Packet& packet, bool forced);
  void locate(Packet& packet);
  void prefetch_one(const Packet& packet, int lane);
  void prefetch_all(const Packet& packet, int first);
  bool in_one_cell(const Packet& packet, int first) const;
  void interpolate(Packet& packet);
  void bend_differentials(Packet& packet, const Tensor& T, const F3& v, F factor, int at);
  template <bool weakly>
  void take_step_as(Packet& packet, PerRay (&p)[3], PerRay (&v)[3], PerRay (&u)[3]);
  void take_step(Packet& packet, PerRay (&p)[3], PerRay (&v)[3], PerRay (&u)[3]);
  void step(Packet& packet);
  void step_watched(Packet& packet);
  std::uint32_t outside(const Packet& packet, const PerRay (&points)[3]) const;
  std::uint32_t stopped(const Packet& packet) const;
  std::uint32_t spent(const Packet& packet) const;
  void locate_on_extent(Packet& packet);
  void take_out(Packet& packet, std::uint32_t stop, std::uint32_t leave);
  void keep_points(const Packet& packet);
  static auto direction(const Packet& packet) -> const PerRay (&)[3] { return uniform ? packet.v : packet.u; }
  float to_world() const { return uniform ? medium_.voxel : 1.0f; }  // Of what u is per.
  void land(Packet& packet);

  const Medium& medium_;
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

/// Copies what a ray is, but for what follows from its brick (see `begin`).
template <bool uniform, bool differentials>
void Kernel<uniform, differentials>::copy_lane(const Packet& from, int of, Packet& to, int lane) {
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
  to.bending_rate[lane] = from.bending_rate[of];
  to.time[lane] = from.time[of];
  to.ray[lane] = from.ray[of];
}

/// Brings the rays that go on to the front if that frees a vector, and lets the other lanes repeat one of them.
template <bool uniform, bool differentials>
void Kernel<uniform, differentials>::close_ranks(Packet& packet) {
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

template <bool uniform, bool differentials>
bool Kernel<uniform, differentials>::fill(Packet& packet) {
  if (next_ == rays_.size()) return false;
  const int count = static_cast<int>(std::min<std::size_t>(packet_rays, rays_.size() - next_));
  packet.alive = ~0u >> (packet_rays - count);
  packet.vectors = packet_rays / lanes;
  packet.clamps = medium_.flat;
  packet.steps = 0;
  packet.most_steps = medium_.settings.max_steps;
  for (int lane = 0; lane < count; ++lane) {
    packet.ray[lane] = static_cast<std::int32_t>(next_++);
    enter(packet, lane);
    packet.most_steps = std::min(packet.most_steps, medium_.settings.max_steps - rays_[packet.ray[lane]].steps);
  }
  if constexpr (!uniform)
    for (int i = 0; i < packet_rays; i += lanes) store(index_direction(load(packet.v, i)), packet.u, i);
  if (count < packet_rays)
    close_ranks(packet);
  else
    begin<uniform>(medium_, packet);
  return true;
}

template <bool uniform, bool differentials>
HWY_INLINE F3 Kernel<uniform, differentials>::index_direction(const F3& v) const {
  if (uniform) return {v.x, v.y, v.z};
  const auto& m = medium_.to_index;
  const auto row = [&](int i) HWY_ATTR {
    return hn::MulAdd(set(m[i][0]), v.x, hn::MulAdd(set(m[i][1]), v.y, hn::Mul(set(m[i][2]), v.z)));
  };
  return {row(0), row(1), row(2)};
}

/// The last step of lanes in bricks where nothing bends light ended a little behind them: takes these lanes to the
/// bricks where they are now. (Others are taken there by their steps' middles, whatever their neighbours do.)
template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::leave_straight_bricks(Packet& packet) {
  const F zero = hn::Zero(floats), end = set(TensorBrick::cells);
  const auto moves = [&](int i) HWY_ATTR {
    const F3 p = load(packet.p, i);
    const auto beyond = [&](F x) HWY_ATTR { return hn::Or(hn::Lt(x, zero), hn::Ge(x, end)); };
    return hn::And(hn::Eq(load(packet.strongest, i), zero), hn::Or(beyond(p.x), hn::Or(beyond(p.y), beyond(p.z))));
  };
  std::uint32_t any = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) any |= to_bits(moves(i), i);
  if (any == 0) return;
  move_to_bricks<uniform>(medium_, packet, [&](int i) HWY_ATTR {
    return select(moves(i), clamp(load(packet.p, i), load(packet.low, i), load(packet.high, i)), zeros());
  });
}

/// How long the next step is, in the units that u is per: voxels, or, if voxels are not uniform, world units.
template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::find_times(Packet& packet) {
  if (packet.straight) leave_straight_bricks(packet);
  const bool automatic = medium_.settings.step == 0;
  const F zero = hn::Zero(floats), end = set(TensorBrick::cells);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F3 u = load(direction(packet), i);
    const F voxel = uniform ? set(1) : hn::Div(set(1), hn::Sqrt(dot(u, u)));
    F steps = set(medium_.longest_step);
    if (automatic && !(packet.greatest_reach <= strongest_kick)) {
      const F kick = hn::Mul(load(packet.bending_rate, i), voxel);
      const F shorter = hn::Max(hn::Div(set(strongest_kick), kick), set(shortest_automatic_step));
      steps = hn::IfThenElse(hn::Gt(hn::Mul(kick, set(longest_automatic_step)), set(strongest_kick)), shorter, steps);
    }
    F time = uniform ? steps : hn::Mul(steps, voxel);
    if (packet.straight) {
      // Out of the brick where nothing bends light, and a little further, so that rounding does not keep it there.
      const F3 p = load(packet.p, i);
      const auto way = [&](F x, F along) HWY_ATTR {
        const F to = hn::Sub(hn::IfThenElse(hn::Gt(along, zero), end, zero), x);
        return hn::IfThenElse(hn::Eq(along, zero), set(1e30f), hn::Div(to, along));
      };
      const F out = hn::Min(hn::Min(way(p.x, u.x), way(p.y, u.y)), way(p.z, u.z));
      const auto within = [&](F x) HWY_ATTR { return hn::And(hn::Ge(x, zero), hn::Le(x, end)); };
      const Mask crosses = hn::And(hn::And(within(p.x), hn::And(within(p.y), within(p.z))),
                                   hn::And(hn::Eq(load(packet.strongest, i), zero), hn::Lt(out, set(1e29f))));
      time = hn::IfThenElse(crosses, hn::MulAdd(set(past_straight_brick), voxel, out), time);
    }
    store(time, packet.time, i);
  }
  packet.timed = !packet.varied;
}

/// Finds the middles of steps, their cells, and what is needed to interpolate there. `careful`: where the packet
/// clamps, or, with `forced`, points are beyond their bricks, on whose faces they then are taken to be.
/// @return whether all are within their lanes' bricks.
template <bool uniform, bool differentials>
template <bool careful>
HWY_INLINE bool Kernel<uniform, differentials>::find_cells(Packet& packet, bool forced) {
  const F last = set(TensorBrick::cells - 1), width = set(TensorBrick::width);
  auto greatest = hn::Zero(bits);
  F first = hn::Zero(floats);
  Mask same = hn::Eq(first, first);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F half = hn::Mul(set(0.5f), load(packet.time, i));
    F3 point = mul_add(half, load(direction(packet), i), load(packet.p, i));
    store(point, packet.middle, i);
    if (careful && packet.clamps) point = clamp(point, load(packet.low, i), load(packet.high, i));
    F3 near = floor(point);
    if (careful && packet.clamps) near = clamp(near, load(packet.low, i), load(packet.last, i));
    // As unsigned integers, negative floats are the greatest.
    greatest = hn::Max(hn::Max(greatest, hn::BitCast(bits, near.x)),
                       hn::Max(hn::BitCast(bits, near.y), hn::BitCast(bits, near.z)));
    if (careful && forced) near = clamp(near, zeros(), {last, last, last});
    const F3 fraction = sub(point, near);
    if constexpr (differentials)
      store(fraction, packet.fraction, i);
    else
      make_weights(fraction, packet, i);
    const F voxel = hn::MulAdd(hn::MulAdd(near.x, width, near.y), width, near.z);
    store(voxel, packet.voxel, i);
    if (i == 0) first = set(hn::GetLane(voxel));
    same = hn::And(same, hn::Eq(voxel, first));
  }
  packet.one_cell = packet.one_brick && hn::AllTrue(floats, same);
  return hn::AllFalse(bits, hn::Gt(greatest, hn::BitCast(bits, last)));
}

/// The first part of a step: to its middle. Takes lanes to the bricks of these points.
template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::locate(Packet& packet) {
  const bool found = packet.clamps ? find_cells<true>(packet, false) : find_cells<false>(packet, false);
  if (HWY_LIKELY(found)) return;
  move_to_bricks<uniform>(medium_, packet, [&](int i) HWY_ATTR {
    const F3 point = load(packet.middle, i);
    return packet.clamps ? clamp(point, load(packet.low, i), load(packet.high, i)) : point;
  });
  find_cells<true>(packet, true);  // Beyond the extent, or on the face that rounding took it to.
}

/// Asks for the memory of the cell where a lane will be after two long steps, if it is in its brick.
template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::prefetch_one(const Packet& packet, int lane) {
  int voxel = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float ahead = packet.middle[axis][lane] + direction(packet)[axis][lane];
    const int cell = static_cast<int>(std::min(std::max(ahead, 0.0f), TensorBrick::cells - 0.5f));
    voxel = voxel * TensorBrick::width + cell;
  }
  prefetch_cell(packet.bending[lane] + voxel * TensorBrick::bending_floats);
}

/// Asks for the memory of the cells where the lanes of a vector will be after two long steps.
template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::prefetch_all(const Packet& packet, int first) {
  float between =
      packet.one_brick ? 0 : 2;  // The outermost lanes, or so: of wavelengths, whose order is that of space.
  for (const PerRay& middle : packet.middle)
    between = std::max(between, std::fabs(middle[first] - middle[first + lanes - 1]));
  if (between < 1) {
    prefetch_one(packet, first);
    return prefetch_one(packet, first + lanes - 1);
  }
  const F3 ahead = add(load(packet.middle, first), load(direction(packet), first));
  const F zero = hn::Zero(floats), cells = set(TensorBrick::cells), part = set(1.0f / TensorBrick::cells);
  const auto bricks = [&](F x) HWY_ATTR { return hn::Floor(hn::Mul(x, part)); };
  const F3 offset{bricks(ahead.x), bricks(ahead.y), bricks(ahead.z)};
  const auto cell = [&](F x, F of) HWY_ATTR { return hn::Floor(hn::NegMulAdd(of, cells, x)); };
  const F width = set(TensorBrick::width);
  const F voxel =
      hn::MulAdd(hn::MulAdd(cell(ahead.x, offset.x), width, cell(ahead.y, offset.y)), width, cell(ahead.z, offset.z));
  alignas(64) std::int32_t voxels[lanes], offsets[3][lanes];
  hn::Store(hn::ConvertTo(ints, voxel), ints, voxels);
  hn::Store(hn::ConvertTo(ints, offset.x), ints, offsets[0]);
  hn::Store(hn::ConvertTo(ints, offset.y), ints, offsets[1]);
  hn::Store(hn::ConvertTo(ints, offset.z), ints, offsets[2]);
  const std::uint32_t moves =
      to_bits(hn::Or(hn::Ne(offset.x, zero), hn::Or(hn::Ne(offset.y, zero), hn::Ne(offset.z, zero))), 0);
  for (int lane = 0; lane < lanes; ++lane) {
    const float* brick = packet.bending[first + lane];
    if (moves >> lane & 1) {
      const std::int32_t at[3] = {packet.brick[0][first + lane] + offsets[0][lane],
                                  packet.brick[1][first + lane] + offsets[1][lane],
                                  packet.brick[2][first + lane] + offsets[2][lane]};
      brick = medium_.brick(at).bending;
    }
    prefetch_cell(brick + voxels[lane] * TensorBrick::bending_floats);
  }
}

/// Whether all lanes of a vector are in one cell.
template <bool uniform, bool differentials>
HWY_INLINE bool Kernel<uniform, differentials>::in_one_cell(const Packet& packet, int first) const {
  Mask same = hn::Eq(load(packet.voxel, first), set(packet.voxel[first]));
  if (!packet.one_brick)
    for (const auto& brick : packet.brick)
      same = hn::And(same, hn::RebindMask(floats, hn::Eq(hn::Load(ints, brick + first), hn::Set(ints, brick[first]))));
  return hn::AllTrue(floats, same);
}

/// The second part: the tensors there.
template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::interpolate(Packet& packet) {
  if (!differentials && HWY_LIKELY(packet.one_cell)) {
    prefetch_one(packet, 0);
    return sample_cell(cell_of(packet, 0), packet, 0, packet.vectors);
  }
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const bool together = in_one_cell(packet, i);
    if (!together) prefetch_all(packet, i);
    if constexpr (differentials) {
      if (together)
        sample_slopes(cell_of(packet, i), packet, i);
      else
        sample_own_slopes(packet, i);
    } else {
      if (together)
        sample_cell<1>(cell_of(packet, i), packet, i);
      else
        sample_own_cells(packet, i);
    }
  }
}

/// The derivatives of exp(factor · T) V, normalised, along two parameters, and those of the positions at the end of the
/// step: of the method's own steps. One term more than without, as the derivative of a series has one less.
template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::bend_differentials(Packet& packet, const Tensor& T, const F3& v,
                                                                   F factor, int at) {
  const F size = load(packet.size, at), half = hn::Mul(set(0.5f), load(packet.time, at));
  for (int i = 0; i < 2; ++i) {
    const F3 dmiddle = mul_add(half, index_direction(load(packet.dv[i], at)), load(packet.dp[i], at));
    F3 along = dmiddle;
    if (medium_.flat)  // The tensor is the same across an axis of a single voxel.
      along = F3{hn::Mul(along.x, set(medium_.slope[0])), hn::Mul(along.y, set(medium_.slope[1])),
                 hn::Mul(along.z, set(medium_.slope[2]))};
    Tensor dT;
    for (int c = 0; c < 8; ++c)
      dT.c[c] = hn::MulAdd(
          along.x, load(packet.slopes[0][c], at),
          hn::MulAdd(along.y, load(packet.slopes[1][c], at), hn::Mul(along.z, load(packet.slopes[2][c], at))));
    F3 term = v, sum = v, dterm = load(packet.dv[i], at), dsum = dterm;
    for (int n = 1; n <= most_terms; ++n) {
      const Mask needed = hn::Gt(size, set(n < 4 ? -1.0f : series_reach[n - 4]));
      if (hn::AllFalse(floats, needed)) break;
      const F part = hn::Mul(set(1.0f / static_cast<float>(n)), factor);
      dterm = mul(part, add(apply(T, dterm), apply(dT, term)));
      term = mul(part, apply(T, term));
      sum = add(sum, select(needed, term, zeros()));
      dsum = add(dsum, select(needed, dterm, zeros()));
    }
    const F inverse = hn::Div(set(1), hn::Sqrt(dot(sum, sum)));
    const F3 unit = mul(inverse, sum), change = mul(inverse, dsum);
    const F3 dv = mul_add(hn::Neg(dot(unit, change)), unit, change);
    store(dv, packet.dv_next[i], at);
    store(mul_add(half, index_direction(dv), dmiddle), packet.dp_next[i], at);
  }
}

/// The third part: bends, and on from the middle, to the positions and directions at the end, which may be the
/// packet's. `weakly`: no lane needs more than two terms.
template <bool uniform, bool differentials>
template <bool weakly>
HWY_INLINE void Kernel<uniform, differentials>::take_step_as(Packet& packet, PerRay (&p)[3], PerRay (&v)[3],
                                                             PerRay (&u)[3]) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F time = load(packet.time, i), factor = hn::Mul(time, load(packet.kick, i)), half = hn::Mul(set(0.5f), time);
    Tensor T;
    for (int c = 0; c < 8; ++c) T.c[c] = load(packet.tensor[c], i);
    const F3 before = load(packet.v, i);
    const F3 after =
        weakly ? bend_weakly(T, before, factor) : bend_strongly<differentials>(packet, T, before, factor, i);
    if constexpr (differentials) bend_differentials(packet, T, before, factor, i);
    store(after, v, i);
    if constexpr (uniform) {
      store(mul_add(half, after, load(packet.middle, i)), p, i);
    } else {
      const F3 along = index_direction(after);
      store(along, u, i);
      store(mul_add(half, along, load(packet.middle, i)), p, i);
    }
  }
}

template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::take_step(Packet& packet, PerRay (&p)[3], PerRay (&v)[3],
                                                          PerRay (&u)[3]) {
  if (!differentials && HWY_LIKELY(packet.greatest_reach <= series_reach[0]))
    return take_step_as<true>(packet, p, v, u);
  take_step_as<false>(packet, p, v, u);
}

/// The lanes whose points are beyond the extent, as bits.
template <bool uniform, bool differentials>
HWY_INLINE std::uint32_t Kernel<uniform, differentials>::outside(const Packet& packet,
                                                                 const PerRay (&points)[3]) const {
  std::uint32_t result = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes)
    for (int axis = 0; axis < 3; ++axis) {
      const F x = load(points[axis], i), margin = set(medium_.margin[axis]);
      result |= to_bits(hn::Or(hn::Lt(hn::Add(x, margin), load(packet.low[axis], i)),
                               hn::Gt(hn::Sub(x, margin), load(packet.high[axis], i))),
                        i);
    }
  return result;
}

/// The lanes that cannot take this step, as bits.
template <bool uniform, bool differentials>
HWY_NOINLINE std::uint32_t Kernel<uniform, differentials>::stopped(const Packet& packet) const {
  std::uint32_t stop = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F3 v = load(packet.v_next, i);
    stop |= to_bits(hn::Not(hn::Gt(dot(v, v), set(0.5f))), i);  // No direction to go in.
  }
  for (std::uint32_t rest = packet.alive; rest != 0; rest &= rest - 1) {
    const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(rest);
    const float before = static_cast<float>(rays_[packet.ray[lane]].length);  // Of the way to the field.
    const float length = (packet.length[lane] + packet.time[lane]) * to_world() + before;
    bool stops = length >= medium_.settings.max_length;
    if (packet.near_surface) {
      double from[3], until[3];
      for (int axis = 0; axis < 3; ++axis) {
        const double base = double{TensorBrick::cells} * packet.brick[axis][lane];
        from[axis] = base + packet.p[axis][lane];
        until[axis] = base + packet.p_next[axis][lane];
      }
      stops |= medium_.meets_surface(from, until);
    }
    if (stops) stop |= 1u << lane;
  }
  return stop;
}

/// The lanes that may take no further step, as bits: those of light that has come through a cut have taken more.
template <bool uniform, bool differentials>
HWY_NOINLINE std::uint32_t Kernel<uniform, differentials>::spent(const Packet& packet) const {
  std::uint32_t result = 0;
  for (std::uint32_t rest = packet.alive; rest != 0; rest &= rest - 1) {
    const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(rest);
    if (rays_[packet.ray[lane]].steps + packet.steps >= medium_.settings.max_steps) result |= 1u << lane;
  }
  return result;
}

/// Takes the middles of steps that lie beyond the extent to the nearest points on it, where the tensor is that of the
/// outermost voxels. Light may turn back into the extent from there.
template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::locate_on_extent(Packet& packet) {
  packet.clamps = true;
  locate(packet);
  interpolate(packet);
  packet.clamps = medium_.flat;
}

/// Hands the rays of some lanes on, as they are before the step.
template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::take_out(Packet& packet, std::uint32_t stop, std::uint32_t leave) {
  Packet& leaving = leaving_[&packet - packets_];
  for (std::uint32_t rest = stop | leave; rest != 0; rest &= rest - 1) {
    const int lane = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest));
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
    copy_lane(packet, lane, leaving, static_cast<int>(hwy::PopCount(leaving.alive)));
    leaving.alive = leaving.alive << 1 | 1;
  }
}

template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::keep_points(const Packet& packet) {
  for (std::uint32_t rest = packet.alive; rest != 0; rest &= rest - 1) {
    const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(rest);
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

/// A step that may end rays: these are taken out as they were before it.
template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::step_watched(Packet& packet) {
  if (packet.near_border && (outside(packet, packet.middle) & packet.alive) != 0) locate_on_extent(packet);
  take_step(packet, packet.p_next, packet.v_next, packet.u_next);
  std::uint32_t stop = 0, leave = 0;
  if (packet.near_border) leave = outside(packet, packet.p_next);
  if (packet.near_surface || medium_.bounded || !(packet.greatest_reach <= strongest_kick)) stop = stopped(packet);
  if (packet.steps >= packet.most_steps) stop |= spent(packet);
  if constexpr (differentials) {  // Those of a crossing are the reference's.
    stop |= leave;
    leave = 0;
  }
  stop &= packet.alive;
  leave &= packet.alive & ~stop;
  if ((stop | leave) != 0) take_out(packet, stop, leave);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    store(load(packet.p_next, i), packet.p, i);
    store(load(packet.v_next, i), packet.v, i);
    if constexpr (!uniform) store(load(packet.u_next, i), packet.u, i);
    store(hn::Add(load(packet.length, i), load(packet.time, i)), packet.length, i);
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) {
        store(load(packet.dp_next[k], i), packet.dp[k], i);
        store(load(packet.dv_next[k], i), packet.dv[k], i);
      }
  }
  ++packet.steps;
  if (!batch_.points.empty()) keep_points(packet);
  if ((stop | leave) != 0 && packet.alive != 0) close_ranks(packet);
}

template <bool uniform, bool differentials>
HWY_INLINE void Kernel<uniform, differentials>::step(Packet& packet) {
  samples_ += hwy::PopCount(packet.alive);
  if (differentials || HWY_UNLIKELY(packet.watched || packet.steps >= packet.most_steps)) return step_watched(packet);
  take_step(packet, packet.p, packet.v, packet.u);
  for (int i = 0; i < packet.vectors * lanes; i += lanes)
    store(hn::Add(load(packet.length, i), load(packet.time, i)), packet.length, i);
  ++packet.steps;
  if (HWY_UNLIKELY(!batch_.points.empty())) keep_points(packet);
}

/// The step that leaves the extent, repeated with the length that ends on its face (Newton's method).
template <bool uniform, bool differentials>
HWY_NOINLINE void Kernel<uniform, differentials>::land(Packet& packet) {
  packet.vectors = packet_rays / lanes;
  close_ranks(packet);
  packet.clamps = true;
  const F zero = hn::Zero(floats), one = set(1);
  PerRay& longest = packet.length;  // Which is known to the rays already.
  alignas(64) PerRay chord[3];
  const auto find = [&]() HWY_ATTR {
    locate(packet);  // Which may take lanes to other bricks.
    interpolate(packet);
    take_step(packet, packet.p_next, packet.v_next, packet.u_next);
  };
  const auto face = [&](int axis, int i) HWY_ATTR {
    const F margin = set(medium_.margin[axis]);
    return hn::IfThenElse(hn::Gt(load(chord[axis], i), zero), hn::Add(load(packet.high[axis], i), margin),
                          hn::Sub(load(packet.low[axis], i), margin));
  };
  alignas(64) PerRay axes;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) store(load(packet.time, i), longest, i);
  find();
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    store(sub(load(packet.p_next, i), load(packet.p, i)), chord, i);
    const auto part = [&](int axis) HWY_ATTR {
      const F along = load(chord[axis], i), gap = hn::Sub(face(axis, i), load(packet.p[axis], i));
      return hn::IfThenElse(hn::Gt(hn::Abs(along), zero), hn::Div(gap, along), set(1e30f));
    };
    const F x = part(0), y = part(1), z = part(2), nearest = hn::Min(hn::Min(x, y), z);
    store(hn::IfThenElse(hn::Eq(x, nearest), zero, hn::IfThenElse(hn::Eq(y, nearest), one, set(2))), axes, i);
    store(hn::Mul(load(longest, i), hn::Min(hn::Max(nearest, zero), one)), packet.time, i);
  }
  for (int n = 0; n < landing_steps; ++n) {
    find();
    for (int i = 0; i < packet.vectors * lanes; i += lanes) {
      const F axis = load(axes, i);
      const auto of_axis = [&](F a, F b, F c) HWY_ATTR {
        return hn::IfThenElse(hn::Eq(axis, zero), a, hn::IfThenElse(hn::Eq(axis, one), b, c));
      };
      const F3 to = load(packet.p_next, i);
      const F3 u = uniform ? load(packet.v_next, i) : load(packet.u_next, i);
      const F gap = hn::Sub(of_axis(face(0, i), face(1, i), face(2, i)), of_axis(to.x, to.y, to.z));
      F rest = hn::Div(gap, of_axis(u.x, u.y, u.z));
      rest = hn::IfThenElseZero(hn::Le(hn::Abs(rest), load(longest, i)), rest);  // But of light that grazes the face.
      const F time = hn::Add(load(packet.time, i), rest);
      if (n < landing_steps - 1) {
        store(hn::Min(hn::Max(time, zero), load(longest, i)), packet.time, i);
      } else {
        store(mul_add(rest, u, to), packet.p_next, i);
        store(time, packet.time, i);
      }
    }
  }
  for (std::uint32_t rest = packet.alive; rest != 0; rest &= rest - 1) {
    const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(rest);
    KernelRay& ray = rays_[packet.ray[lane]];
    for (int axis = 0; axis < 3; ++axis) {
      ray.brick[axis] = packet.brick[axis][lane];
      ray.position[axis] = packet.p_next[axis][lane];
      ray.direction[axis] = packet.v_next[axis][lane];
    }
    ray.axis = static_cast<std::int8_t>(axes[lane]);
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
      if (packet.alive == 0) continue;
      busy = true;
      if (HWY_UNLIKELY(!packet.timed)) find_times(packet);
      locate(packet);
      interpolate(packet);
      step(packet);
      if (HWY_LIKELY(packet.alive != 0)) continue;
      Packet& leaving = leaving_[&packet - packets_];
      if (leaving.alive != 0) land(leaving);
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
  [[maybe_unused]] const WithoutDenormals guard;
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
