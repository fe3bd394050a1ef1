/// @file integrators/packets/packet_splines-inl.h
/// The tensor at the rays of a packet in a cubic field. A part of packet_kernel-inl.h.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_SPLINES_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_SPLINES_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_SPLINES_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_SPLINES_TOGGLE
#endif

#include <hwy/highway.h>

#include "integrators/packets/packet_cells-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

/// Weights of the four coefficients about each lane along each axis, and their derivatives.
struct alignas(64) SplineWeights {
  float value[3][4][lanes], slope[3][4][lanes];
};

/// The weights of cubic_weights and, if `slopes`, of cubic_slopes.
template <bool slopes>
HWY_INLINE void find_weights(const Packet& packet, int at, SplineWeights& weights) {
  const F sixth = set(1.0f / 6), two_thirds = set(2.0f / 3), half = set(0.5f), one = set(1), two = set(2);
  for (int axis = 0; axis < 3; ++axis) {
    const F t = load(packet.fraction[axis], at), u = hn::Sub(one, t);
    const F tt = hn::Mul(t, t), uu = hn::Mul(u, u);
    auto& value = weights.value[axis];
    hn::Store(hn::Mul(hn::Mul(uu, u), sixth), floats, value[0]);
    hn::Store(hn::NegMulAdd(hn::Mul(half, tt), hn::Sub(two, t), two_thirds), floats, value[1]);
    hn::Store(hn::NegMulAdd(hn::Mul(half, uu), hn::Sub(two, u), two_thirds), floats, value[2]);
    hn::Store(hn::Mul(hn::Mul(tt, t), sixth), floats, value[3]);
    if constexpr (slopes) {
      auto& slope = weights.slope[axis];
      const F three_halves = set(1.5f);
      hn::Store(hn::Mul(hn::Neg(half), uu), floats, slope[0]);
      hn::Store(hn::Mul(t, hn::MulSub(three_halves, t, two)), floats, slope[1]);
      hn::Store(hn::Mul(u, hn::NegMulAdd(three_halves, u, two)), floats, slope[2]);
      hn::Store(hn::Mul(half, tt), floats, slope[3]);
    }
  }
}

/// The first of the 4³ coefficients about a lane.
template <int components>
HWY_INLINE const float* first_coefficient(const Packet& packet, int lane) {
  return packet.bending[lane] + CubicBrick::bending_offset(components, static_cast<int>(packet.voxel[lane]));
}

template <int components>
constexpr int row_stride = CubicBrick::bending_offset(components, CubicBrick::width);
template <int components>
constexpr int sheet_stride = row_stride<components>* CubicBrick::width;

/// Asks for the coefficients about a lane.
template <int components>
HWY_INLINE void prefetch_spline(const float* first) {
  constexpr int row = 4 * components;  // Floats.
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 4; ++y) {
      const float* const along = first + x * sheet_stride<components> + y * row_stride<components>;
      hwy::Prefetch(along);
      hwy::Prefetch(along + 16);
      if (row > 32) hwy::Prefetch(along + row - 1);
    }
}

using V8 = hn::Vec<Eight>;

/// Four coefficients along z, or four sums of such, each in a vector of `eight_lanes` components.
struct Four {
  V8 z[4];
};

HWY_INLINE Four four_zeros() {
  const V8 zero = hn::Zero(eight);
  return {{zero, zero, zero, zero}};
}

HWY_INLINE V8 along_z(const Four& sums, const float (&weights)[4][lanes], int lane) {
  const auto weight = [&](int k) HWY_ATTR { return hn::Set(eight, weights[k][lane]); };
  return hn::MulAdd(weight(0), sums.z[0],
                    hn::MulAdd(weight(1), sums.z[1], hn::MulAdd(weight(2), sums.z[2], hn::Mul(weight(3), sums.z[3]))));
}

/// Components `c` and following of a lane's tensor: the sums along y, then x, then z.
template <int components>
HWY_INLINE V8 spline_value(const float* first, const SplineWeights& weights, int lane, int c) {
  Four sums = four_zeros();
#pragma GCC unroll 4
  for (int x = 0; x < 4; ++x) {
    const float* const sheet = first + x * sheet_stride<components> + c;
    Four lines = four_zeros();
#pragma GCC unroll 4
    for (int y = 0; y < 4; ++y) {
      const V8 weight = hn::Set(eight, weights.value[1][y][lane]);
#pragma GCC unroll 4
      for (int z = 0; z < 4; ++z)
        lines.z[z] =
            hn::MulAdd(weight, hn::LoadU(eight, sheet + y * row_stride<components> + z * components), lines.z[z]);
    }
    const V8 weight = hn::Set(eight, weights.value[0][x][lane]);
#pragma GCC unroll 4
    for (int z = 0; z < 4; ++z) sums.z[z] = hn::MulAdd(weight, lines.z[z], sums.z[z]);
  }
  return along_z(sums, weights.value[2], lane);
}

/// The same with the slopes.
template <int components>
HWY_INLINE Slopes<V8> spline_slopes(const float* first, const SplineWeights& weights, int lane, int c) {
  Four sums = four_zeros(), by_x = sums, by_y = sums;
  for (int x = 0; x < 4; ++x) {
    const float* const sheet = first + x * sheet_stride<components> + c;
    Four lines = four_zeros(), slopes = lines;
    for (int y = 0; y < 4; ++y) {
      const V8 weight = hn::Set(eight, weights.value[1][y][lane]), slope = hn::Set(eight, weights.slope[1][y][lane]);
      for (int z = 0; z < 4; ++z) {
        const V8 coefficient = hn::LoadU(eight, sheet + y * row_stride<components> + z * components);
        lines.z[z] = hn::MulAdd(weight, coefficient, lines.z[z]);
        slopes.z[z] = hn::MulAdd(slope, coefficient, slopes.z[z]);
      }
    }
    const V8 weight = hn::Set(eight, weights.value[0][x][lane]), slope = hn::Set(eight, weights.slope[0][x][lane]);
    for (int z = 0; z < 4; ++z) {
      sums.z[z] = hn::MulAdd(weight, lines.z[z], sums.z[z]);
      by_x.z[z] = hn::MulAdd(slope, lines.z[z], by_x.z[z]);
      by_y.z[z] = hn::MulAdd(weight, slopes.z[z], by_y.z[z]);
    }
  }
  const auto& along = weights.value[2];
  return {along_z(sums, along, lane), along_z(by_x, along, lane), along_z(by_y, along, lane),
          along_z(sums, weights.slope[2], lane)};
}

/// Samples the tensors of a vector.
template <int components>
HWY_INLINE void sample_spline(Packet& packet, int at) {
  SplineWeights weights;
  find_weights<false>(packet, at, weights);
  for (int c = 0; c < components; c += eight_lanes) {
    F rows[eight_lanes];
    for (int row = 0; row < eight_lanes; ++row)
      rows[row] = row_of(
          [&](int lane) HWY_ATTR {
            return spline_value<components>(first_coefficient<components>(packet, at + lane), weights, lane, c);
          },
          row);
    transpose_rows(rows);
    for (int row = 0; row < std::min(eight_lanes, components - c); ++row) store(rows[row], packet.tensor[c + row], at);
  }
}

/// The same with their slopes.
template <int components>
HWY_INLINE void sample_spline_slopes(Packet& packet, int at) {
  SplineWeights weights;
  find_weights<true>(packet, at, weights);
  alignas(64) float values[4][lanes * 8];
  for (int c = 0; c < components; c += eight_lanes)
    for (int lane = 0; lane < lanes; ++lane) {
      const auto sampled =
          spline_slopes<components>(first_coefficient<components>(packet, at + lane), weights, lane, c);
      store_components(sampled.value, c, lane, values[0]);
      store_components(sampled.x, c, lane, values[1]);
      store_components(sampled.y, c, lane, values[2]);
      store_components(sampled.z, c, lane, values[3]);
    }
  transpose<components>(values[0], packet.tensor, at);
  for (int axis = 0; axis < 3; ++axis) transpose<components>(values[1 + axis], packet.slopes[axis], at);
}

/// Samples the tensors of all lanes, and their slopes for rays with differentials.
template <int components, bool differentials>
HWY_INLINE void sample_splines(Packet& packet) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    if constexpr (differentials)
      sample_spline_slopes<components>(packet, i);
    else
      sample_spline<components>(packet, i);
  }
}

/// T₂₂ and its slopes at the points where the lanes' tensors were sampled.
template <int components>
HWY_NOINLINE Slopes<F> sample_trailing_spline(const Packet& packet, int at) {
  SplineWeights weights;
  find_weights<true>(packet, at, weights);
  alignas(64) float values[4][lanes];
  for (int lane = 0; lane < lanes; ++lane) {
    const float* const first =
        packet.bending[at + lane] + CubicBrick::trailing_offset(components) + static_cast<int>(packet.voxel[at + lane]);
    float sums[4] = {};  // The value, and its slopes along x, y and z.
    for (int i = 0; i < 64; ++i) {
      const int k[3] = {i >> 4, i >> 2 & 3, i & 3};
      const float coefficient = first[(k[0] * CubicBrick::width + k[1]) * CubicBrick::width + k[2]];
      for (int n = 0; n < 4; ++n) {
        float product = coefficient;
        for (int axis = 0; axis < 3; ++axis)
          product *= (n == axis + 1 ? weights.slope : weights.value)[axis][k[axis]][lane];
        sums[n] += product;
      }
    }
    for (int n = 0; n < 4; ++n) values[n][lane] = sums[n];
  }
  return {hn::Load(floats, values[0]), hn::Load(floats, values[1]), hn::Load(floats, values[2]),
          hn::Load(floats, values[3])};
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
