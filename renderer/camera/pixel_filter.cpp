#include "renderer/camera/pixel_filter.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"

namespace tensorray {
namespace {

/// The quantiles of one half of a filter are tabulated at this many equal steps; the other half mirrors it.
constexpr int steps = 512;
/// The first steps have a finer table of their own, and in its first steps the quantile is searched for: it has no
/// finite derivative at an end where the density is 0.
constexpr int searched_steps = 12;

/// All shapes are defined on [−1, 1] and have integral 1.
struct Gaussian {
  static constexpr double steepness = 4.5;  ///< exp(−steepness x²): the radius is 3 σ.

  static double density(double x) { return (std::exp(-steepness * x * x) - edge()) / (2 * half_integral(1)); }
  static double cumulative(double x) { return 0.5 + half_integral(x) / (2 * half_integral(1)); }

 private:
  static double edge() { return std::exp(-steepness); }
  static double half_integral(double x) {
    return std::sqrt(pi / steepness) / 2 * std::erf(std::sqrt(steepness) * x) - x * edge();
  }
};

/// Harris 1978, "On the Use of Windows for Harmonic Analysis with the Discrete Fourier Transform": minimum 4-term.
struct BlackmanHarris {
  static constexpr double a0 = 0.35875, a1 = 0.48829, a2 = 0.14128, a3 = 0.01168;

  static double density(double x) {
    const double c = std::cos(pi * x);
    return (a0 + a1 * c + a2 * (2 * c * c - 1) + a3 * c * (4 * c * c - 3)) / (2 * a0);
  }
  static double cumulative(double x) {
    const double c = std::cos(pi * x), s = std::sin(pi * x);
    const double sines = a1 * s + a2 * s * c + a3 / 3 * s * (4 * c * c - 1);
    return 0.5 + (a0 * x + sines / pi) / (2 * a0);
  }
};

}  // namespace

PixelFilter::PixelFilter(PixelFilterShape shape) : shape_(shape), radius_(shape == PixelFilterShape::box ? 0.5 : 1.5) {
  if (shape == PixelFilterShape::box) return;
  middle_ = quantiles(0.5);
  end_ = quantiles(0.5 * searched_steps / steps);
}

/// The quantiles from 0 to `last`, at equal steps.
std::vector<PixelFilter::Quantile> PixelFilter::quantiles(double last) const {
  std::vector<Quantile> result{{-radius_, 0}};
  for (int i = 1; i <= steps; ++i) {
    const double x = invert(last * i / steps, result.back().position, 0);
    result.push_back({x, last / (steps * density(x))});
  }
  return result;
}

/// Not of the box, as `cumulative`.
double PixelFilter::density(double x) const {
  const double t = x / radius_;
  return (shape_ == PixelFilterShape::gaussian ? Gaussian::density(t) : BlackmanHarris::density(t)) / radius_;
}

double PixelFilter::cumulative(double x) const {
  const double t = x / radius_;
  return shape_ == PixelFilterShape::gaussian ? Gaussian::cumulative(t) : BlackmanHarris::cumulative(t);
}

double PixelFilter::sample(double u) const {
  if (shape_ == PixelFilterShape::box) return (2 * u - 1) * radius_;
  return u < 0.5 ? lower_sample(u) : -lower_sample(1 - u);
}

/// Interpolates the quantiles by the cubic polynomials that also have their derivatives (Hermite).
/// @param u  0 to ½.
double PixelFilter::lower_sample(double u) const {
  const bool is_end = u < 0.5 * searched_steps / steps;
  const std::vector<Quantile>& quantiles = is_end ? end_ : middle_;
  const double place = u * (is_end ? 2.0 * steps * steps / searched_steps : 2.0 * steps);
  const int i = std::min(static_cast<int>(place), steps - 1);
  const Quantile &low = quantiles[i], &high = quantiles[i + 1];
  if (is_end && i < searched_steps) return invert(u, low.position, high.position);
  const double t = place - i, rest = 1 - t;
  return low.position + t * t * (3 - 2 * t) * (high.position - low.position) +
         t * rest * (rest * low.slope - t * high.slope);
}

/// Finds x between low and high with cumulative(x) = u, by Newton's method, and bisection where a step leaves these.
double PixelFilter::invert(double u, double low, double high) const {
  double x = (low + high) / 2;
  for (int i = 0; i < 60; ++i) {
    const double excess = cumulative(x) - u;
    (excess > 0 ? high : low) = x;
    const double newton = x - excess / density(x);
    const double next = newton >= low && newton <= high ? newton : (low + high) / 2;
    if (std::abs(next - x) <= 1e-9 * radius_) return next;
    x = next;
  }
  return x;
}

}  // namespace tensorray
