/// @file integrators/packet_cells-inl.h
/// Vectors with a ray in each lane, and the tensor at them. A part of packet_kernel.cpp.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_CELLS_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_CELLS_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_CELLS_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_CELLS_TOGGLE
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

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

HWY_INLINE F3 clamp(const F3& p, const F3& low, const F3& high) {
  return {hn::Min(hn::Max(p.x, low.x), high.x), hn::Min(hn::Max(p.y, low.y), high.y),
          hn::Min(hn::Max(p.z, low.z), high.z)};
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

/// Asks for the memory of a cell.
HWY_INLINE void prefetch_cell(const float* corner) {
  constexpr int z = TensorBrick::bending_floats, y = TensorBrick::width * z, x = TensorBrick::width * y;
  for (const int edge : {0, y, x, x + y}) {
    hwy::Prefetch(corner + edge);
    hwy::Prefetch(corner + edge + z);
  }
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
