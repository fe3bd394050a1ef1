#include "tracing/paths/path_thinning.h"

#include <algorithm>
#include <limits>

#include "renderer/surfaces/polyline.h"
#include "volumes/sampling/tensor_sampler.h"

// The code before HWY_AFTER_NAMESPACE is compiled once for each kind of processor. It calls no inline functions of
// other headers: the linker would keep only one of their copies, which may be compiled for the wrong processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tracing/paths/path_thinning.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// Must come after foreach_target.h:
#include <hwy/highway.h>

#ifndef TENSORRAY_INTEGRATORS_PATH_THINNING
#define TENSORRAY_INTEGRATORS_PATH_THINNING
namespace tensorray {
namespace {

constexpr float min_square = std::numeric_limits<float>::min();  // No division by zero.

/// Points of a path, and factors that make squares of errors 1 where they are just allowed.
struct PathInterpolation {
  const float* positions;
  const float* lengths;
  const float* more;
  const float* tensors;  // Null if only positions are compared.
  const float* squares;
  std::size_t room;
  float position_factor, tensor_factor;
  bool strict;  // Whether no error is allowed, so that the search ends soon after the first one.
};

}  // namespace
}  // namespace tensorray
#endif

HWY_BEFORE_NAMESPACE();
namespace tensorray::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using F = hn::Vec<Floats>;

/// A piece of a path: interpolates between points i and j.
struct Piece {
  const PathInterpolation& path;
  std::size_t i, j;
  float inverse_length;

  /// Where the points from `at` on lie between i and j, from 0 to 1.
  HWY_INLINE F fraction(std::size_t at) const {
    const Floats d;
    const F high = hn::Sub(hn::LoadU(d, path.lengths + at), hn::Set(d, path.lengths[i]));
    const F low = hn::Sub(hn::LoadU(d, path.more + at), hn::Set(d, path.more[i]));
    return hn::Mul(hn::Add(high, low), hn::Set(d, inverse_length));
  }

  /// Squared distances of `count` components from their interpolation.
  template <int count>
  HWY_INLINE F missed(const float* values, std::size_t at, F fraction) const {
    const Floats d;
    F sum = hn::Zero(d);
    for (int c = 0; c < count; ++c, values += path.room) {
      const F rise = hn::Set(d, values[j] - values[i]);
      const F apart = hn::Sub(hn::MulAdd(fraction, rise, hn::Set(d, values[i])), hn::LoadU(d, values + at));
      sum = hn::MulAdd(apart, apart, sum);
    }
    return sum;
  }

  HWY_INLINE F errors(std::size_t at) const {
    const Floats d;
    const F t = fraction(at);
    const F apart = hn::Mul(missed<3>(path.positions, at, t), hn::Set(d, path.position_factor));
    if (!path.tensors) return apart;
    const float ends = HWY_MAX(path.squares[i], path.squares[j]);
    const F square = hn::Max(hn::LoadU(d, path.squares + at), hn::Set(d, ends));
    const F unlike = hn::Mul(missed<9>(path.tensors, at, t), hn::Set(d, path.tensor_factor));
    return hn::Max(apart, hn::Div(unlike, square));
  }
};

/// Of the points between i and j, the one that interpolation between these misses most; of several, the first. The
/// error is its square.
Worst max_missed(const PathInterpolation& path, std::size_t i, std::size_t j) {
  const Floats d;
  const Ints ints;
  const Piece piece{path, i, j, 1 / ((path.lengths[j] - path.lengths[i]) + (path.more[j] - path.more[i]))};
  F greatest = hn::Zero(d);
  hn::Vec<Ints> where = hn::Zero(ints);
  const std::int32_t count = static_cast<std::int32_t>(j - i - 1);
  constexpr std::int32_t block = 64;  // Number of points that are compared before the search may end.
  for (std::int32_t begin = 0; begin < count; begin += block) {
    const std::int32_t end = HWY_MIN(count, begin + block);
    for (std::int32_t k = begin; k < end; k += static_cast<std::int32_t>(hn::Lanes(d))) {
      const auto number = hn::Iota(ints, k);
      const F errors = piece.errors(i + 1 + static_cast<std::size_t>(k));
      const auto is_worse = hn::And(hn::Gt(errors, greatest), hn::RebindMask(d, hn::Lt(number, hn::Set(ints, count))));
      greatest = hn::IfThenElse(is_worse, errors, greatest);
      where = hn::IfThenElse(hn::RebindMask(ints, is_worse), number, where);
    }
    if (path.strict && !hn::AllFalse(d, hn::Gt(greatest, hn::Set(d, 1)))) break;
  }
  const F most = hn::MaxOfLanes(d, greatest);
  const auto is_most = hn::RebindMask(ints, hn::Eq(greatest, most));
  const auto first = hn::MinOfLanes(ints, hn::IfThenElse(is_most, where, hn::Set(ints, count)));
  return {hn::GetLane(most), i + 1 + static_cast<std::size_t>(hn::GetLane(first))};
}

void set_squares(const float* tensors, std::size_t room, float* squares) {
  const Floats d;
  for (std::size_t i = 0; i < room; i += hn::Lanes(d)) {
    F sum = hn::Set(d, min_square);
    for (std::size_t c = 0; c < 9; ++c) {
      const F value = hn::LoadU(d, tensors + c * room + i);
      sum = hn::MulAdd(value, value, sum);
    }
    hn::StoreU(sum, d, squares + i);
  }
}

}  // namespace
}  // namespace tensorray::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

HWY_EXPORT(max_missed);
HWY_EXPORT(set_squares);

std::vector<std::size_t> thinned(const PathSamples& samples, double tolerance, double tensor_tolerance) {
  // The factor that makes the square of an allowed error 1.
  const auto factor = [](double allowed) { return std::min(static_cast<float>(1 / (allowed * allowed)), 1e30f); };
  PathInterpolation path{};
  std::vector<float> squares;
  path.positions = samples.positions.data();
  path.lengths = samples.lengths.data();
  path.more = samples.more.data();
  path.room = samples.room;
  path.position_factor = factor(tolerance);
  path.strict = tolerance == 0;
  if (!samples.tensors.empty()) {
    squares.resize(samples.room + sampled_room(1));  // A vector may begin at the last point.
    HWY_DYNAMIC_DISPATCH(set_squares)(samples.tensors.data(), samples.room, squares.data());
    path.tensors = samples.tensors.data();
    path.squares = squares.data();
    path.tensor_factor = factor(tensor_tolerance);
    path.strict = path.strict || tensor_tolerance == 0;
  }
  return thinned(samples.count, [&](std::size_t first, std::size_t last) -> Worst {
    if (last - first < 2) return {};
    return HWY_DYNAMIC_DISPATCH(max_missed)(path, first, last);
  });
}

}  // namespace tensorray
#endif
