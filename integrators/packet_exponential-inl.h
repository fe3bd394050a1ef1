/// @file integrators/packet_exponential-inl.h
/// Kicks so strong that no series of them converges: scaling and squaring, in double precision. A part of
/// packet_kernel.cpp.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_EXPONENTIAL_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_EXPONENTIAL_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_EXPONENTIAL_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_EXPONENTIAL_TOGGLE
#endif

#include <algorithm>
#include <cmath>

#include <hwy/highway.h>

#include "integrators/packet_cells-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

using Doubles = hn::CappedTag<double, 8>;
using Singles = hn::Rebind<float, Doubles>;
using D = hn::Vec<Doubles>;
constexpr Doubles doubles;
constexpr int double_lanes = static_cast<int>(hn::MaxLanes(Doubles()));

struct Matrix {
  D m[3][3];  // Row by row.
};

HWY_INLINE D promoted(const float* from) { return hn::PromoteTo(doubles, hn::Load(Singles(), from)); }

HWY_INLINE void multiply(const Matrix& a, const Matrix& b, Matrix& product) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      product.m[i][j] =
          hn::MulAdd(a.m[i][0], b.m[0][j], hn::MulAdd(a.m[i][1], b.m[1][j], hn::Mul(a.m[i][2], b.m[2][j])));
}

HWY_INLINE void scale(D factor, Matrix& a) {
  for (auto& row : a.m)
    for (D& value : row) value = hn::Mul(factor, value);
}

/// The sum of `f(value)` over the entries.
template <class F1>
HWY_INLINE D sum_of(const Matrix& a, const F1& f) {
  D sum = hn::Zero(doubles);
  for (const auto& row : a.m)
    for (const D& value : row) sum = hn::Add(sum, f(value));
  return sum;
}

/// s h times the deviator of T. (The trace only changes the length.)
HWY_INLINE void strong_deviator(const Packet& packet, int at, Matrix& A) {
  const Singles singles;
  const D factor =
      hn::PromoteTo(doubles, hn::Mul(hn::Load(singles, packet.time + at), hn::Load(singles, packet.kick + at)));
  for (int i = 0; i < 8; ++i) A.m[i % 3][i / 3] = hn::Mul(factor, promoted(packet.tensor[i] + at));
  const D third = hn::Mul(hn::Set(doubles, 1.0 / 3), hn::Add(A.m[0][0], A.m[1][1]));
  A.m[0][0] = hn::Sub(A.m[0][0], third);
  A.m[1][1] = hn::Sub(A.m[1][1], third);
  A.m[2][2] = hn::Neg(third);
}

/// Scales A down to a norm below 1. @return by how many halvings, of each lane.
HWY_INLINE D halve(Matrix& A, D norm) {
  alignas(64) double norms[double_lanes], halvings[double_lanes], parts[double_lanes];
  hn::Store(norm, doubles, norms);
  for (int i = 0; i < double_lanes; ++i) {
    const int count = std::isfinite(norms[i]) && norms[i] >= 1 ? std::ilogb(norms[i]) + 1 : 0;
    halvings[i] = count;
    parts[i] = std::ldexp(1.0, -count);
  }
  scale(hn::Load(doubles, parts), A);
  return hn::Load(doubles, halvings);
}

/// exp(A) for ‖A‖ < 1 by its power series, to 1e-12 as exponential.cpp.
HWY_INLINE void small_exponential(const Matrix& A, Matrix& power) {
  constexpr int terms = 14;
  power = A;
  scale(hn::Set(doubles, 1.0 / terms), power);
  for (int n = terms - 1; n > 0; --n) {
    for (int i = 0; i < 3; ++i) power.m[i][i] = hn::Add(power.m[i][i], hn::Set(doubles, 1.0));
    Matrix part = A, product;
    scale(hn::Set(doubles, 1.0 / n), part);
    multiply(part, power, product);
    power = product;
  }
  for (int i = 0; i < 3; ++i) power.m[i][i] = hn::Add(power.m[i][i], hn::Set(doubles, 1.0));
}

/// Squares as many times as each lane asks for. Only directions are wanted: every second time lengths are taken away,
/// so that nothing overflows; nor, of a shear as strong as single precision has them, 1e76, does anything underflow.
HWY_INLINE void square(D times, Matrix& power) {
  const auto magnitude = [](D value) HWY_ATTR { return hn::Abs(value); };
  const int most = static_cast<int>(hn::GetLane(hn::MaxOfLanes(doubles, times)));
  for (int n = 0; n < most; ++n) {
    Matrix product;
    multiply(power, power, product);
    if (n % 2 == 1) scale(hn::Div(hn::Set(doubles, 1.0), sum_of(product, magnitude)), product);
    const auto wanted = hn::Gt(times, hn::Set(doubles, n));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) power.m[i][j] = hn::IfThenElse(wanted, product.m[i][j], power.m[i][j]);
  }
}

/// exp(s h T) V, normalised, of some lanes, given as bits; zero if it has no direction.
HWY_NOINLINE void bend_in_double(const Packet& packet, std::uint32_t which, PerRay (&to)[3]) {
  alignas(64) float bent[3][double_lanes];
  for (int at = 0; at < packet.vectors * lanes; at += double_lanes) {
    std::uint32_t here = which >> at & ((1u << double_lanes) - 1);
    if (here == 0) continue;
    Matrix A, power;
    strong_deviator(packet, at, A);
    const D norm = hn::Sqrt(sum_of(A, [](D value) HWY_ATTR { return hn::Mul(value, value); }));
    const D halvings = halve(A, norm);
    small_exponential(A, power);
    square(halvings, power);
    const D x = promoted(packet.v[0] + at), y = promoted(packet.v[1] + at), z = promoted(packet.v[2] + at);
    D v[3], squares = hn::Zero(doubles);
    for (int i = 0; i < 3; ++i) {
      v[i] = hn::MulAdd(power.m[i][0], x, hn::MulAdd(power.m[i][1], y, hn::Mul(power.m[i][2], z)));
      squares = hn::MulAdd(v[i], v[i], squares);
    }
    const D inverse = hn::Div(hn::Set(doubles, 1.0), hn::Sqrt(squares));
    const auto has_direction = hn::And(hn::Lt(norm, hn::Set(doubles, 1e150)), hn::Gt(squares, hn::Zero(doubles)));
    for (int i = 0; i < 3; ++i)
      hn::Store(hn::DemoteTo(Singles(), hn::IfThenElseZero(has_direction, hn::Mul(inverse, v[i]))), Singles(), bent[i]);
    for (; here != 0; here &= here - 1) {
      const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(here);
      for (int i = 0; i < 3; ++i) to[i][at + static_cast<int>(lane)] = bent[i][lane];
    }
  }
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
