/// @file integrators/packets/packet_cells-inl.h
/// Vectors with a ray in each lane, and the tensor at these rays. A part of packet_kernel-inl.h.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_CELLS_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_CELLS_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_CELLS_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_CELLS_TOGGLE
#endif

#include <algorithm>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 16>;
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

// `at` is the first lane of a vector of a packet.

HWY_INLINE F set(float value) { return hn::Set(floats, value); }
HWY_INLINE F load(const PerRay& from, int at) { return hn::Load(floats, from + at); }
HWY_INLINE F3 load(const PerRay (&from)[3], int at) {
  return {load(from[0], at), load(from[1], at), load(from[2], at)};
}
HWY_INLINE void store(F value, PerRay& to, int at) { hn::Store(value, floats, to + at); }
HWY_INLINE void store(const F3& v, PerRay (&to)[3], int at) {
  store(v.x, to[0], at);
  store(v.y, to[1], at);
  store(v.z, to[2], at);
}
HWY_INLINE F3 zeros() { return {hn::Zero(floats), hn::Zero(floats), hn::Zero(floats)}; }
HWY_INLINE F3 add(const F3& a, const F3& b) { return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)}; }
HWY_INLINE F3 sub(const F3& a, const F3& b) { return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)}; }
HWY_INLINE F3 mul(F s, const F3& a) { return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)}; }
HWY_INLINE F3 mul_add(F s, const F3& a, const F3& b) {
  return {hn::MulAdd(s, a.x, b.x), hn::MulAdd(s, a.y, b.y), hn::MulAdd(s, a.z, b.z)};
}
HWY_INLINE F dot(const F3& a, const F3& b) { return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z))); }
HWY_INLINE F3 floor(const F3& a) { return {hn::Floor(a.x), hn::Floor(a.y), hn::Floor(a.z)}; }
HWY_INLINE F3 select(Mask mask, const F3& yes, const F3& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y), hn::IfThenElse(mask, yes.z, no.z)};
}
HWY_INLINE F3 minimum(const F3& a, const F3& b) { return {hn::Min(a.x, b.x), hn::Min(a.y, b.y), hn::Min(a.z, b.z)}; }
HWY_INLINE F3 clamp(const F3& p, const F3& low, const F3& high) {
  return {hn::Min(hn::Max(p.x, low.x), high.x), hn::Min(hn::Max(p.y, low.y), high.y),
          hn::Min(hn::Max(p.z, low.z), high.z)};
}
/// One bit for each lane of the packet.
HWY_INLINE std::uint32_t to_bits(Mask mask, int at) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(floats, mask, bytes);
  std::uint32_t result;
  std::memcpy(&result, bytes, sizeof result);
  return (result & ((1u << lanes) - 1)) << at;
}

/// The tensor whose stored component i is `stored(i)`.
template <int components, class Stored>
HWY_INLINE Tensor tensor_of(const Stored& stored) {
  Tensor T;
  for (int i = 0; i < 8; ++i) T.c[i] = stored(TensorBrick::stored_component(components, i));
  return T;
}

template <int components>
HWY_INLINE Tensor load_tensor(const Packet& packet, int at) {
  return tensor_of<components>([&](int i) HWY_ATTR { return load(packet.tensor[i], at); });
}

/// T V.
HWY_INLINE F3 apply(const Tensor& T, const F3& v) {
  return {hn::MulAdd(T.c[6], v.z, hn::MulAdd(T.c[3], v.y, hn::Mul(T.c[0], v.x))),
          hn::MulAdd(T.c[7], v.z, hn::MulAdd(T.c[4], v.y, hn::Mul(T.c[1], v.x))),
          hn::MulAdd(T.c[5], v.y, hn::Mul(T.c[2], v.x))};
}

/// Whether all lanes of a vector are in one cell.
HWY_INLINE bool in_one_cell(const Packet& packet, int first) {
  Mask same = hn::Eq(load(packet.voxel, first), set(packet.voxel[first]));
  if (!packet.one_brick && hn::AllTrue(floats, same))
    for (const auto& brick : packet.brick)
      same = hn::And(same, hn::RebindMask(floats, hn::Eq(hn::Load(ints, brick + first), hn::Set(ints, brick[first]))));
  return hn::AllTrue(floats, same);
}

/// The corners of a cell: offsets from its first voxel, in voxels. z changes first, then y, then x.
constexpr int corners[8] = {TensorBrick::voxel(0, 0, 0), TensorBrick::voxel(0, 0, 1), TensorBrick::voxel(0, 1, 0),
                            TensorBrick::voxel(0, 1, 1), TensorBrick::voxel(1, 0, 0), TensorBrick::voxel(1, 0, 1),
                            TensorBrick::voxel(1, 1, 0), TensorBrick::voxel(1, 1, 1)};

/// Distances of neighbouring voxels, in floats.
template <int components>
constexpr int y_stride = TensorBrick::bending_offset(components, TensorBrick::voxel(0, 1, 0));
template <int components>
constexpr int x_stride = TensorBrick::bending_offset(components, TensorBrick::voxel(1, 0, 0));

using Eight = hn::CappedTag<float, 8>;  // For the components of one voxel.
constexpr Eight eight;
constexpr int eight_lanes = static_cast<int>(hn::MaxLanes(Eight()));

/// The memory of a cell: its first voxel, and the next one along z.
struct Cell {
  const float *near, *far;
};

template <int components>
HWY_INLINE Cell cell_of(const Packet& packet, int lane) {
  const int voxel = static_cast<int>(packet.voxel[lane]);
  const float* const brick = packet.bending[lane];
  return {brick + TensorBrick::bending_offset(components, voxel),
          brick + TensorBrick::bending_offset(components, voxel + 1)};
}

/// The near end of edge i of a cell along y. Odd edges are at the far voxel along z, edges 2 and 3 at the far one
/// along x.
template <int components>
HWY_INLINE const float* edge_of(const Cell& cell, int i) {
  return (i % 2 ? cell.far : cell.near) + i / 2 * x_stride<components>;
}

/// The lane of a far voxel's first component, where vectors hold more than the components of a voxel: these vectors end
/// with its last component, so that no cache line beyond the cell is read.
template <int components>
constexpr int far_lane = components < eight_lanes ? eight_lanes - components : 0;

/// Components c and following of the voxel at an end of edge i.
template <int components>
HWY_INLINE hn::Vec<Eight> load_voxel(const float* voxel, int i, int c) {
  if (components == TensorBrick::general) return hn::Load(eight, voxel + c);
  return hn::LoadU(eight, voxel + c - (i % 2 ? far_lane<components> : 0));
}

template <class V>
HWY_INLINE V between(V near, V far, V fraction) {
  return hn::MulAdd(hn::Sub(far, near), fraction, near);
}

/// Trilinear interpolation along y, then x, then z. `edge(i)` is the value on edge i, interpolated along y. `aligned`
/// moves values of far voxels to the lanes of near ones. The operations and their order are the same wherever they are
/// done, and so are the results, bit for bit.
template <class V, class Edge, class Aligned>
HWY_INLINE V trilinear(const Edge& edge, const Aligned& aligned, V x, V z) {
  const V first = between(edge(0), edge(2), x);
  return between(first, aligned(between(edge(1), edge(3), x)), z);
}

/// Samples the tensors of `count` vectors, one or two, whose lanes are all in one cell. `rises` are those of the cell's
/// edges. Each value is loaded once for all vectors, and copied to all lanes.
template <int components, int count>
HWY_INLINE void sample_cell(const Cell& cell, const float (&rises)[4][8], Packet& packet, int first) {
  F3 at[count];
  for (int n = 0; n < count; ++n) at[n] = load(packet.fraction, first + n * lanes);
#pragma GCC unroll 8
  for (int c = 0; c < components; ++c) {
    F values[count];
#pragma GCC unroll 2
    for (int n = 0; n < count; ++n)
      values[n] = trilinear(
          [&](int i) HWY_ATTR {
            const float rise = rises[i][(i % 2 ? far_lane<components> : 0) + c];
            return hn::MulAdd(set(rise), at[n].y, set(edge_of<components>(cell, i)[c]));
          },
          [](F far) HWY_ATTR { return far; }, at[n].x, at[n].z);
#pragma GCC unroll 2
    for (int n = 0; n < count; ++n) store(values[n], packet.tensor[c], first + n * lanes);
  }
}

/// The same for any number of vectors.
template <int components>
HWY_INLINE void sample_cell(const Cell& cell, Packet& packet, int first, int count) {
  alignas(64) float rises[4][8];
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < components; c += eight_lanes) {
      const float* const edge = edge_of<components>(cell, i);
      const auto rise =
          hn::Sub(load_voxel<components>(edge + y_stride<components>, i, c), load_voxel<components>(edge, i, c));
      hn::Store(rise, eight, rises[i] + c);
    }
  for (; count > 1; count -= 2, first += 2 * lanes) sample_cell<components, 2>(cell, rises, packet, first);
  if (count > 0) sample_cell<components, 1>(cell, rises, packet, first);
}

/// Prefetches the memory of a cell, given its first voxel. In three of four cells of a symmetric field the next voxel
/// along z is in the same cache line. Prefetching it costs more than it gains.
template <int components>
HWY_INLINE void prefetch_cell(const float* cell) {
  for (const int edge : {0, y_stride<components>, x_stride<components>, x_stride<components> + y_stride<components>}) {
    hwy::Prefetch(cell + edge);
    if (components == TensorBrick::general) hwy::Prefetch(cell + edge + components);
  }
}

/// Offsets, in floats, of voxels in their bricks, given their numbers. They are the last bits of sums so great that
/// their last bit is 1, or ½ for five components, whose offset is floor(16/3 voxel).
template <int components>
HWY_INLINE hn::Vec<Bits> offsets_of(F voxel) {
  constexpr bool halves = components == TensorBrick::symmetric;
  const F sum = hn::MulAdd(voxel, set(halves ? 16.0f / 3 : components), set(halves ? 4194304.0f : 8388608.0f));
  const auto offset = hn::And(hn::BitCast(bits, sum), hn::Set(bits, 0x7FFFFF));
  return halves ? hn::ShiftRight<1>(offset) : offset;
}

/// Offsets of the cells of lanes, in floats from the first voxels of their bricks: near and far voxels along z, and the
/// cells that are prefetched.
struct Offsets {
  alignas(64) std::uint32_t near[packet_rays], far[packet_rays], ahead[packet_rays];
};

/// Moves the components of a far voxel to the lanes of those of a near one.
template <int components>
HWY_INLINE hn::Vec<Eight> aligned(hn::Vec<Eight> far) {
  if constexpr (far_lane<components> == 0) {
    return far;
  } else {
    alignas(32) constexpr std::int32_t from[8] = {3, 4, 5, 6, 7, 0, 1, 2};
    static_assert(far_lane<components> == 3, "the table moves components by three lanes");
    return hn::TableLookupLanes(far, hn::SetTableIndices(eight, from));
  }
}

/// Keeps a value in a register: GCC would read it from memory again for each use.
template <class V>
HWY_INLINE V in_register(V value) {
#if HWY_COMPILER_GCC_ACTUAL && HWY_ARCH_X86 && HWY_TARGET <= HWY_SSE2
  asm("" : "+x"(value.raw));
#endif
  return value;
}

/// Components `c` and following of a lane's tensor.
template <int components>
HWY_INLINE hn::Vec<Eight> sample_lane(const Packet& packet, const Cell& cell, int lane, int c) {
  const auto fraction = [&](int axis) HWY_ATTR { return hn::Set(eight, packet.fraction[axis][lane]); };
  const auto edge = [&](int i) HWY_ATTR {
    const float* const voxel = edge_of<components>(cell, i);
    return between(in_register(load_voxel<components>(voxel, i, c)),
                   load_voxel<components>(voxel + y_stride<components>, i, c), fraction(1));
  };
  return trilinear(edge, aligned<components>, fraction(0), fraction(2));
}

/// Four rows to four columns in each block of four.
HWY_INLINE void transpose_blocks([[maybe_unused]] F* rows) {
#if HWY_TARGET != HWY_SCALAR
  const hn::Repartition<double, Floats> pairs;
  const auto lower = [&](F a, F b) HWY_ATTR { return hn::BitCast(pairs, hn::InterleaveLower(floats, a, b)); };
  const auto upper = [&](F a, F b) HWY_ATTR { return hn::BitCast(pairs, hn::InterleaveUpper(floats, a, b)); };
  const auto near = lower(rows[0], rows[1]), near_2 = lower(rows[2], rows[3]);
  const auto far = upper(rows[0], rows[1]), far_2 = upper(rows[2], rows[3]);
  rows[0] = hn::BitCast(floats, hn::InterleaveLower(pairs, near, near_2));
  rows[1] = hn::BitCast(floats, hn::InterleaveUpper(pairs, near, near_2));
  rows[2] = hn::BitCast(floats, hn::InterleaveLower(pairs, far, far_2));
  rows[3] = hn::BitCast(floats, hn::InterleaveUpper(pairs, far, far_2));
#endif
}

/// Rows of the components of lanes to a vector for each component.
HWY_INLINE void transpose_rows([[maybe_unused]] F (&rows)[eight_lanes]) {
#if HWY_TARGET != HWY_SCALAR
  transpose_blocks(rows);
  if constexpr (eight_lanes == 8) {
    transpose_blocks(rows + 4);
    for (int i = 0; i < 4; ++i) {
      const F first = rows[i], second = rows[4 + i];
      rows[i] = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(second), first);
      rows[4 + i] = hn::OddEvenBlocks(second, hn::SwapAdjacentBlocks(first));
    }
  }
#endif
}

/// A row: components of a lane, and, if vectors hold more, those of the lane that is eight further.
template <class Sample>
HWY_INLINE F row_of(const Sample& sample, int lane) {
#if HWY_TARGET != HWY_SCALAR
  if constexpr (lanes > eight_lanes)
    return hn::Combine(floats, sample(lane + eight_lanes), sample(lane));
  else
#endif
    return sample(lane);
}

/// Samples the tensors of a vector whose lanes are in several cells: a register holds the components of one lane at a
/// time. Prefetches the cells ahead.
template <int components>
HWY_INLINE void sample_own_cells(Packet& packet, int at, const Offsets& offsets) {
  const auto cell = [&](int lane) HWY_ATTR {
    const float* const brick = packet.bending[at + lane];
    return Cell{brick + offsets.near[at + lane], brick + offsets.far[at + lane]};
  };
  for (int c = 0; c < components; c += eight_lanes) {
    F rows[eight_lanes];
#pragma GCC unroll 8
    for (int row = 0; row < eight_lanes; ++row)
      rows[row] =
          row_of([&](int lane) HWY_ATTR { return sample_lane<components>(packet, cell(lane), at + lane, c); }, row);
    if (c == 0)
      for (int lane = 0; lane < lanes; ++lane)
        prefetch_cell<components>(packet.bending[at + lane] + offsets.ahead[at + lane]);
    transpose_rows(rows);
    for (int row = 0; row < std::min(eight_lanes, components - c); ++row) store(rows[row], packet.tensor[c + row], at);
  }
}

/// The trilinear polynomial of a cell: coefficients of 1, z, y, yz, x, xz, xy and xyz. Rays with differentials use it,
/// because its slopes cost little more than its value.
template <class V>
struct Polynomial {
  V k[8];
};

/// The polynomial with the value `c(k)` at corner k.
template <class V, class Corner>
HWY_INLINE Polynomial<V> polynomial(const Corner& c) {
  const V z = hn::Sub(c(1), c(0)), y = hn::Sub(c(2), c(0)), x = hn::Sub(c(4), c(0));
  const V yz = hn::Sub(hn::Sub(c(3), c(2)), z);
  const V far = hn::Sub(c(5), c(4)), far_y = hn::Sub(c(6), c(4));
  const V xyz = hn::Sub(hn::Sub(hn::Sub(c(7), c(6)), far), yz);
  return {{c(0), z, y, yz, x, hn::Sub(far, z), hn::Sub(far_y, y), xyz}};
}

/// The polynomials of components `c` and following.
template <int components>
HWY_INLINE Polynomial<hn::Vec<Eight>> cell_polynomial(const Cell& cell, int c) {
  return polynomial<hn::Vec<Eight>>([&](int k) HWY_ATTR {
    return hn::LoadU(eight, edge_of<components>(cell, k / 4 * 2 + k % 2) + k / 2 % 2 * y_stride<components> + c);
  });
}

/// A value and its slopes.
template <class V>
struct Slopes {
  V value, x, y, z;
};

template <class V>
HWY_INLINE Slopes<V> evaluate(const Polynomial<V>& p, V x, V y, V z) {
  const V y_near = hn::MulAdd(p.k[3], z, p.k[2]), y_far = hn::MulAdd(p.k[7], z, p.k[6]);
  const V near = hn::MulAdd(y_near, y, hn::MulAdd(p.k[1], z, p.k[0]));
  const V slope = hn::MulAdd(y_far, y, hn::MulAdd(p.k[5], z, p.k[4]));
  return {hn::MulAdd(slope, x, near), slope, hn::MulAdd(y_far, x, y_near),
          hn::MulAdd(hn::MulAdd(p.k[7], y, p.k[5]), x, hn::MulAdd(p.k[3], y, p.k[1]))};
}

/// Stores components of a lane's tensor: first the first four components of all lanes, then the last four.
template <class V>
HWY_INLINE void store_components(V values, int i, int lane, float* components) {
  float* const first = components + (i / 4 * lanes + lane) * 4 + i % 4;
#if HWY_TARGET != HWY_SCALAR
  if constexpr (eight_lanes == 8) {
    const hn::Half<Eight> four;
    hn::Store(hn::LowerHalf(four, values), four, first);
    return hn::Store(hn::UpperHalf(four, values), four, first + lanes * 4);
  }
#endif
  hn::Store(values, eight, first);
}

/// Reorders components from lane after lane to component after component.
template <int components>
HWY_INLINE void transpose(const float* values, PerRay (&tensor)[8], int at) {
  for (int half = 0; half < 2; ++half) {
    F a, b, c, d;
    hn::LoadInterleaved4(floats, values + half * lanes * 4, a, b, c, d);
    store(a, tensor[4 * half], at);
    if (4 * half + 1 >= components) break;
    store(b, tensor[4 * half + 1], at);
    store(c, tensor[4 * half + 2], at);
    store(d, tensor[4 * half + 3], at);
  }
}

/// Samples the tensors and their slopes for a vector whose lanes are in one cell.
template <int components>
HWY_INLINE void sample_slopes(const Cell& cell, Packet& packet, int at) {
  alignas(64) float coefficients[8][8];
  for (int i = 0; i < components; i += eight_lanes) {
    const auto polynomial = cell_polynomial<components>(cell, i);
    for (int k = 0; k < 8; ++k) hn::Store(polynomial.k[k], eight, coefficients[k] + i);
  }
  const F3 fraction = load(packet.fraction, at);
  for (int c = 0; c < components; ++c) {
    Polynomial<F> polynomial;
    for (int k = 0; k < 8; ++k) polynomial.k[k] = set(coefficients[k][c]);
    const Slopes<F> sampled = evaluate(polynomial, fraction.x, fraction.y, fraction.z);
    store(sampled.value, packet.tensor[c], at);
    store(sampled.x, packet.slopes[0][c], at);
    store(sampled.y, packet.slopes[1][c], at);
    store(sampled.z, packet.slopes[2][c], at);
  }
}

/// The same for a vector whose lanes are in several cells.
template <int components>
HWY_INLINE void sample_own_slopes(Packet& packet, int at, const Offsets& offsets) {
  alignas(64) float values[4][lanes * 8];
  for (int i = 0; i < components; i += eight_lanes) {
    for (int lane = 0; lane < lanes; ++lane) {
      if (i == 0) prefetch_cell<components>(packet.bending[at + lane] + offsets.ahead[at + lane]);
      const Cell cell = cell_of<components>(packet, at + lane);
      const auto fraction = [&](int axis) HWY_ATTR { return hn::Set(eight, packet.fraction[axis][at + lane]); };
      const auto sampled = evaluate(cell_polynomial<components>(cell, i), fraction(0), fraction(1), fraction(2));
      store_components(sampled.value, i, lane, values[0]);
      store_components(sampled.x, i, lane, values[1]);
      store_components(sampled.y, i, lane, values[2]);
      store_components(sampled.z, i, lane, values[3]);
    }
  }
  transpose<components>(values[0], packet.tensor, at);
  for (int axis = 0; axis < 3; ++axis) transpose<components>(values[1 + axis], packet.slopes[axis], at);
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
