#include "renderer/density/kernel_deposit.h"

#include <algorithm>
#include <cmath>

// The code before HWY_AFTER_NAMESPACE is compiled once for each kind of processor. It calls no inline functions of
// other headers: the linker would keep only one of their copies, which may be compiled for the wrong processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "renderer/density/kernel_deposit.cpp"
#include <hwy/foreach_target.h>  // Must come before highway.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tensorray {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t block = 64;  // Number of points whose weights are computed together.

/// Weights along one axis: for each of the six pixels, the weights of all points of a block.
struct AxisWeights {
  alignas(64) double of[spline_taps][block];
};

/// The quintic B-spline at the distances t, 1 + t and 2 + (1 − t) from its centre.
template <class V>
void set_weights(V t, double* middle, double* flank, double* end) {
  const hn::DFromV<V> d;
  const auto term = [&](V factor, double constant) { return hn::MulAdd(factor, t, hn::Set(d, constant)); };
  const V square = hn::Mul(t, t);
  const V inner = hn::MulAdd(square, hn::MulAdd(t, hn::Set(d, -1.0 / 12), hn::Set(d, 0.25)), hn::Set(d, -0.5));
  hn::Store(hn::MulAdd(square, inner, hn::Set(d, 11.0 / 20)), d, middle);
  const V outer = term(term(term(hn::Set(d, 1.0 / 24), -1.0 / 6), 1.0 / 6), 1.0 / 6);
  hn::Store(term(term(outer, -5.0 / 12), 13.0 / 60), d, flank);
  hn::Store(hn::Mul(hn::Mul(square, square), hn::Mul(t, hn::Set(d, 1.0 / 120))), d, end);
}

void set_axis_weights(const double* beyond, std::size_t count, AxisWeights& weights) {
  const hn::CappedTag<double, 8> d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto t = hn::Load(d, beyond + i);
    set_weights(t, &weights.of[2][i], &weights.of[1][i], &weights.of[5][i]);
    set_weights(hn::Sub(hn::Set(d, 1), t), &weights.of[3][i], &weights.of[4][i], &weights.of[0][i]);
  }
}

/// The weights of one kernel: its columns and rows, `step` elements apart.
struct KernelWeights {
  const double *columns, *rows;
  std::size_t step, taps;  // The number of taps is even.
};

/// Adds the outer product of `line` and the weights of the rows. @param pixels  Where the kernel begins; it and `line`
/// have so many `values` for each column.
template <std::size_t values>
HWY_INLINE void add_rows(double* pixels, const double* line, const KernelWeights& weights,
                         const DepositTarget& target) {
  const hn::CappedTag<double, values == 1 ? 2 : values> d;
  const auto rounding = hn::Set(d, target.rounding);
  for (std::size_t j = 0; j < weights.taps; ++j, pixels += values * target.width) {
    const auto weight = hn::Set(d, weights.rows[j * weights.step]);
    for (std::size_t i = 0; i < values * weights.taps; i += hn::Lanes(d)) {
      const auto rounded = hn::Sub(hn::MulAdd(weight, hn::LoadU(d, line + i), rounding), rounding);
      hn::StoreU(hn::Add(hn::LoadU(d, pixels + i), rounded), d, pixels + i);
    }
  }
}

/// Adds the kernel of one point. @param line  Work space: a value for each column, or four if there are colours.
HWY_INLINE void add_kernel(const DensityPoint& point, const KernelWeights& weights, const DepositTarget& target,
                           double* line) {
  const std::size_t pixel = point.row * target.width + point.column;
  if (!target.colors) {
    for (std::size_t i = 0; i < weights.taps; ++i) line[i] = weights.columns[i * weights.step];
    return add_rows<1>(target.pixels + pixel, line, weights, target);
  }
  const PixelColor& color = target.colors[point.channel];
  const hn::CappedTag<double, 4> d;
  for (std::size_t i = 0; i < weights.taps; ++i)
    for (std::size_t c = 0; c < 4; c += hn::Lanes(d))
      hn::Store(hn::Mul(hn::Set(d, weights.columns[i * weights.step]), hn::Load(d, &color.values[c])), d,
                line + 4 * i + c);
  add_rows<4>(target.pixels + 4 * pixel, line, weights, target);
}

void deposit_splines(const DensityPoint* points, std::size_t count, const DepositTarget& target) {
  AxisWeights x, y;
  alignas(64) double beyond_x[block] = {}, beyond_y[block] = {}, line[4 * spline_taps];
  for (std::size_t first = 0; first < count; first += block) {
    const std::size_t size = count - first < block ? count - first : block;
    for (std::size_t i = 0; i < size; ++i) {
      beyond_x[i] = points[first + i].x;
      beyond_y[i] = points[first + i].y;
    }
    set_axis_weights(beyond_x, size, x);
    set_axis_weights(beyond_y, size, y);
    for (std::size_t i = 0; i < size; ++i)
      add_kernel(points[first + i], {&x.of[0][i], &y.of[0][i], block, spline_taps}, target, line);
  }
}

/// @param work  Six values for each column that the kernel covers.
void deposit_gaussians(const DensityPoint* points, std::size_t count, const GaussianKernel& kernel, double* work,
                       const DepositTarget& target) {
  const auto taps = static_cast<std::size_t>(kernel.taps());
  double *const line = work, *const x = line + 4 * taps, *const y = x + taps;
  for (const DensityPoint* point = points; point != points + count; ++point) {
    kernel.weights(point->x, x);
    kernel.weights(point->y, y);
    add_kernel(*point, {x, y, 1, taps}, target, line);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace tensorray
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

HWY_EXPORT(deposit_splines);
HWY_EXPORT(deposit_gaussians);

void deposit_splines(const std::vector<DensityPoint>& points, std::size_t first, std::size_t last,
                     const DepositTarget& target) {
  HWY_DYNAMIC_DISPATCH(deposit_splines)(points.data() + first, last - first, target);
}

void deposit_gaussians(const std::vector<DensityPoint>& points, std::size_t first, std::size_t last,
                       const GaussianKernel& kernel, const DepositTarget& target) {
  std::vector<PixelColor> work((static_cast<std::size_t>(kernel.taps()) * 6 + 3) / 4);
  HWY_DYNAMIC_DISPATCH(deposit_gaussians)
  (points.data() + first, last - first, kernel, work[0].values, target);
}

void deposit_counts(const std::vector<DensityPoint>& points, std::size_t first, std::size_t last,
                    const DepositTarget& target) {
  for (std::size_t i = first; i < last; ++i) {
    const std::size_t pixel = points[i].row * target.width + points[i].column;
    if (!target.colors) {
      ++target.pixels[pixel];
      continue;
    }
    for (int c = 0; c < 3; ++c)
      target.pixels[4 * pixel + c] += target.colors[points[i].channel].values[c] + target.rounding - target.rounding;
  }
}

GaussianKernel::GaussianKernel(double tau, double reach) : tau_(tau), reach_(reach) {
  const int half = static_cast<int>(std::floor(reach)) + 1;
  for (int i = 1 - half; i <= half; ++i) samples_.push_back(std::exp(-0.5 * i * i / (tau * tau)));
}

/// Uses exp(−(i − t)²/2τ²) = exp(−i²/2τ²) exp(t/τ²)^i, up to a factor that normalising removes.
void GaussianKernel::weights(double beyond, double* out) const {
  const int half = taps() / 2;
  double* const middle = out + half - 1;
  const double* const sample = samples_.data() + half - 1;
  const double base = std::exp(beyond / (tau_ * tau_));
  double sum = middle[0] = sample[0];
  double power = 1, inverse = 1;
  for (int i = 1; i <= half; ++i) {
    power *= base;
    inverse /= base;
    sum += middle[i] = i - beyond <= reach_ ? sample[i] * power : 0;
    if (i < half) sum += middle[-i] = beyond + i <= reach_ ? sample[-i] * inverse : 0;
  }
  for (int i = 0; i < taps(); ++i) out[i] /= sum;
}

}  // namespace tensorray
#endif
