/// @file integrators/kernels/packet_exponential-inl.h
/// Kicks that are too strong for a series in single precision, by scaling and squaring in double precision. A part of
/// packet_kernel-inl.h.

// Included once for each instruction set: see Highway's foreach_target.h.
#if defined(TENSORRAY_INTEGRATORS_PACKET_EXPONENTIAL_TOGGLE) == defined(HWY_TARGET_TOGGLE)
#ifdef TENSORRAY_INTEGRATORS_PACKET_EXPONENTIAL_TOGGLE
#undef TENSORRAY_INTEGRATORS_PACKET_EXPONENTIAL_TOGGLE
#else
#define TENSORRAY_INTEGRATORS_PACKET_EXPONENTIAL_TOGGLE
#endif

#include <algorithm>

#include <hwy/highway.h>

#include "integrators/packets/packet_cells-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

using Doubles = hn::CappedTag<double, 8>;
using Singles = hn::Rebind<float, Doubles>;
using Counts = hn::RebindToSigned<Doubles>;
using D = hn::Vec<Doubles>;
constexpr Doubles doubles;
constexpr int double_lanes = static_cast<int>(hn::MaxLanes(Doubles()));

struct D3 {
  D x[3];
};

struct Matrix {
  D m[9];  // Row by row.
};

/// The polynomial c[0] I + c[1] A + c[2] A² of a matrix A without trace, for which A³ = p A + q I (Cayley and
/// Hamilton).
struct MatrixPolynomial {
  D p, q, c[3];
};

/// A norm above 2^28 counts as 2^28: in single precision, A of that norm is known only to within 8.
constexpr int most_squarings = 31;

HWY_INLINE D set_double(double value) { return hn::Set(doubles, value); }
HWY_INLINE D promoted(const float* from) { return hn::PromoteTo(doubles, hn::Load(Singles(), from)); }

/// A V.
HWY_INLINE D3 multiply(const Matrix& A, const D3& v) {
  const auto row = [&](int i) HWY_ATTR {
    return hn::MulAdd(A.m[i], v.x[0], hn::MulAdd(A.m[i + 1], v.x[1], hn::Mul(A.m[i + 2], v.x[2])));
  };
  return {{row(0), row(3), row(6)}};
}

/// A A.
HWY_INLINE void square(const Matrix& A, D (&product)[9]) {
  for (int i = 0; i < 9; i += 3)
    for (int j = 0; j < 3; ++j)
      product[i + j] = hn::MulAdd(A.m[i], A.m[j], hn::MulAdd(A.m[i + 1], A.m[3 + j], hn::Mul(A.m[i + 2], A.m[6 + j])));
}

HWY_INLINE D dot(const D3& a, const D3& b) {
  return hn::MulAdd(a.x[0], b.x[0], hn::MulAdd(a.x[1], b.x[1], hn::Mul(a.x[2], b.x[2])));
}

/// 1 over the greatest power of two that is not greater than a positive value. Products with it are exact.
HWY_INLINE D inverse_power_of_two(D value) {
  const hn::RebindToUnsigned<Doubles> integers;
  const auto power = hn::And(hn::BitCast(integers, value), hn::Set(integers, std::uint64_t{0x7FF} << 52));
  return hn::BitCast(doubles, hn::Sub(hn::Set(integers, std::uint64_t{2 * 1023} << 52), power));
}

/// σ h times the deviator of T. (The trace changes only the length.)
template <int components>
HWY_INLINE void strong_deviator(const Packet& packet, float part, int at, Matrix& A) {
  const Singles singles;
  const auto time = hn::Mul(hn::Set(singles, part), hn::Load(singles, packet.time + at));
  const D factor = hn::PromoteTo(doubles, hn::Mul(time, hn::Load(singles, packet.kick + at)));
  for (int i = 0; i < 8; ++i)
    A.m[i % 3 * 3 + i / 3] =
        hn::Mul(factor, promoted(packet.tensor[TensorBrick::stored_component(components, i)] + at));
  const D third = hn::Mul(set_double(1.0 / 3), hn::Add(A.m[0], A.m[4]));
  A.m[0] = hn::Sub(A.m[0], third);
  A.m[4] = hn::Sub(A.m[4], third);
  A.m[8] = hn::Neg(third);
}

HWY_INLINE D norm(const Matrix& A) {
  const auto row = [&](int i) HWY_ATTR {
    return hn::MulAdd(A.m[i], A.m[i], hn::MulAdd(A.m[i + 1], A.m[i + 1], hn::Mul(A.m[i + 2], A.m[i + 2])));
  };
  return hn::Sqrt(hn::Add(hn::Add(row(0), row(3)), row(6)));
}

/// Scales A, whose norm is `norm`, to a norm below ¼. @return the number of squarings that each lane's exponential then
/// needs.
HWY_INLINE hn::Vec<Counts> halve(Matrix& A, D norm) {
  const Counts counts;
  const D inverse = inverse_power_of_two(norm);
  for (D& value : A.m) value = hn::Mul(value, hn::Mul(inverse, set_double(0.125)));
  const auto biased = hn::BitCast(counts, hn::ShiftRight<52>(hn::BitCast(hn::RebindToUnsigned<Doubles>(), inverse)));
  return hn::Min(hn::Sub(hn::Set(counts, 1023 + 3), biased), hn::Set(counts, most_squarings));
}

/// exp(A) for ‖A‖ < ¼ by its power series, to 1e-12. Aⁿ is h(n − 2) A² + h(n − 1) A + q h(n − 3) I.
HWY_INLINE MatrixPolynomial small_exponential(const Matrix& A) {
  constexpr double factorials[] = {1, 1, 2, 6, 24, 120, 720, 5040, 40320, 362880, 3628800, 39916800};
  constexpr int terms = 9, first[] = {3, 1, 2};
  const auto minor = [&](int i, int k, int j, int l) HWY_ATTR {
    return hn::MulSub(A.m[3 * i + j], A.m[3 * k + l], hn::Mul(A.m[3 * i + l], A.m[3 * k + j]));
  };
  const D x = minor(1, 2, 1, 2), y = minor(1, 2, 2, 0), z = minor(1, 2, 0, 1);
  MatrixPolynomial of;
  of.p = hn::Neg(hn::Add(hn::Add(minor(0, 1, 0, 1), minor(0, 2, 0, 2)), x));
  of.q = hn::MulAdd(A.m[0], x, hn::MulAdd(A.m[1], y, hn::Mul(A.m[2], z)));
  D h[terms] = {set_double(1), set_double(0), of.p, of.q};
  for (int n = 4; n < terms; ++n) h[n] = hn::MulAdd(of.p, h[n - 2], hn::Mul(of.q, h[n - 3]));
  for (int i = 0; i < 3; ++i) {
    of.c[i] = set_double(1 / factorials[first[i]]);
    for (int n = 2; n < terms; ++n) of.c[i] = hn::MulAdd(set_double(1 / factorials[n + first[i]]), h[n], of.c[i]);
  }
  of.c[0] = hn::MulAdd(of.q, of.c[0], set_double(1));
  return of;
}

/// Squares each lane `times` times. `squared()` gives the square of what `values` represent; only the ratios of the
/// values matter. Every fourth time the values are divided by a power of two near their greatest, which is exact. With
/// this, nothing overflows, and for a shear of 2^28 nothing underflows.
template <int count, class Squared>
HWY_INLINE void square_repeatedly(hn::Vec<Counts> times, D (&values)[count], const Squared& squared) {
  alignas(64) std::int64_t of_lanes[double_lanes];
  hn::Store(times, Counts(), of_lanes);
  const auto [least, most] = std::minmax_element(of_lanes, of_lanes + double_lanes);
  for (int n = 0; n < *most; ++n) {
    D product[count];
    squared(product);
    if (n % 4 == 3) {
      D greatest = hn::Abs(product[0]);
      for (int i = 1; i < count; ++i) greatest = hn::Max(greatest, hn::Abs(product[i]));
      const D inverse = inverse_power_of_two(greatest);
      for (D& value : product) value = hn::Mul(value, inverse);
    }
    if (n >= *least) {
      const auto wanted = hn::RebindMask(doubles, hn::Gt(times, hn::Set(Counts(), n)));
      for (int i = 0; i < count; ++i) product[i] = hn::IfThenElse(wanted, product[i], values[i]);
    }
    std::copy(product, product + count, values);
  }
}

/// exp(A) V, where A is as scaled by `halve`: squares the polynomial of its exponential. @return the lanes whose terms
/// do not cancel to less than 1e-6 of their size. They cancel for light in a plane that shrinks; its direction then
/// consists of rounding errors.
HWY_INLINE hn::Mask<Doubles> bend_by_polynomial(const Matrix& A, MatrixPolynomial of, hn::Vec<Counts> squarings,
                                                const D3& before, D3& v) {
  const D doubled = hn::Add(of.p, of.p);
  square_repeatedly(squarings, of.c, [&](D(&product)[3]) HWY_ATTR {
    // A³ and A⁴ are replaced by lower powers.
    const D twice = hn::Add(of.c[0], of.c[0]), part = hn::Mul(of.q, of.c[2]);
    product[0] = hn::MulAdd(hn::Add(part, part), of.c[1], hn::Mul(of.c[0], of.c[0]));
    product[1] = hn::MulAdd(hn::MulAdd(doubled, of.c[2], twice), of.c[1], hn::Mul(part, of.c[2]));
    product[2] = hn::MulAdd(hn::MulAdd(of.p, of.c[2], twice), of.c[2], hn::Mul(of.c[1], of.c[1]));
  });
  const D3 once = multiply(A, before), twice = multiply(A, once);
  for (int i = 0; i < 3; ++i)
    v.x[i] = hn::MulAdd(of.c[0], before.x[i], hn::MulAdd(of.c[1], once.x[i], hn::Mul(of.c[2], twice.x[i])));
  const auto size = [&](D c, const D3& term) HWY_ATTR { return hn::Mul(hn::Mul(c, c), dot(term, term)); };
  const D greatest = hn::Max(size(of.c[0], before), hn::Max(size(of.c[1], once), size(of.c[2], twice)));
  return hn::Gt(dot(v, v), hn::Mul(greatest, set_double(1e-12)));
}

/// The same by squaring the exponential itself. Where two coordinate axes span the plane that shrinks, this keeps the
/// light in it.
static HWY_NOINLINE D3 bend_by_matrix(const Matrix& A, const MatrixPolynomial& of, hn::Vec<Counts> squarings,
                                      const D3& before) {
  Matrix power;
  square(A, power.m);
  for (int i = 0; i < 9; ++i) power.m[i] = hn::MulAdd(of.c[2], power.m[i], hn::Mul(of.c[1], A.m[i]));
  for (int i = 0; i < 9; i += 4) power.m[i] = hn::Add(of.c[0], power.m[i]);
  square_repeatedly(squarings, power.m, [&](D(&product)[9]) HWY_ATTR { square(power, product); });
  return multiply(power, before);
}

/// Stores Λ of the strong kicks of some lanes, given as bits: −3 ln |exp(A) V|, where A is σ h times the deviator of T.
/// Only few lanes have such kicks.
template <int components>
HWY_NOINLINE void change_in_double(Packet& packet, const PerRay (&from)[3], float part, std::uint32_t which) {
  for (; which != 0; which &= which - 1) {
    const auto lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(which);
    const float v[3] = {from[0][lane], from[1][lane], from[2][lane]};
    float T[9];
    for (int i = 0; i < 8; ++i) T[i] = packet.tensor[TensorBrick::stored_component(components, i)][lane];
    T[8] = 0;
    packet.change_of_step[lane] = strong_log_radiance_scale(T, part * packet.time[lane] * packet.kick[lane], v);
  }
}

/// exp(σ h T) V, normalised, of some lanes, given as bits; zero if it has no direction. h is the part `part` of the
/// step. `changes`: stores Λ of the kick.
template <int components, bool changes>
HWY_NOINLINE void bend_in_double(Packet& packet, const PerRay (&from)[3], float part, std::uint32_t which,
                                 PerRay (&to)[3]) {
  if constexpr (changes) change_in_double<components>(packet, from, part, which);
  const Singles singles;
  for (int at = 0; at < packet.vectors * lanes; at += double_lanes) {
    const std::uint8_t bytes[8] = {static_cast<std::uint8_t>(which >> at & ((1u << double_lanes) - 1))};
    if (bytes[0] == 0) continue;
    const auto wanted = hn::LoadMaskBits(singles, bytes);
    Matrix A;
    strong_deviator<components>(packet, part, at, A);
    const D size = norm(A);
    const auto squarings = halve(A, size);
    const MatrixPolynomial exponential = small_exponential(A);
    const D3 before{{promoted(from[0] + at), promoted(from[1] + at), promoted(from[2] + at)}};
    D3 v;
    const auto precise = bend_by_polynomial(A, exponential, squarings, before, v);
    if (HWY_UNLIKELY(!hn::AllTrue(doubles, precise))) {
      const D3 instead = bend_by_matrix(A, exponential, squarings, before);
      for (int i = 0; i < 3; ++i) v.x[i] = hn::IfThenElse(precise, v.x[i], instead.x[i]);
    }
    const D squares = dot(v, v);
    const auto has_direction = hn::And(hn::Lt(size, set_double(1e150)), hn::Gt(squares, set_double(0)));
    const D inverse = hn::IfThenElseZero(has_direction, hn::Div(set_double(1), hn::Sqrt(squares)));
    for (int i = 0; i < 3; ++i)
      hn::BlendedStore(hn::DemoteTo(singles, hn::Mul(inverse, v.x[i])), wanted, singles, to[i] + at);
  }
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
