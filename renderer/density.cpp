#include "renderer/density.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

constexpr int degree = 5;                  // Of the B-splines.
constexpr double smallest_spline_tau = 2;  // Below it the spline interpolant of the Gaussian is not good enough.
constexpr double cut_off = 4.5;            // In tau; the Gaussian is 4e-5 of its peak there.

/// Folds an index back into [0, size) as mirrors at the edges (between pixels) do.
int mirror(int index, int size) {
  const int period = 2 * size;
  index = ((index % period) + period) % period;
  return index < size ? index : period - 1 - index;
}

using Weights = std::array<double, degree + 1>;

/// The B-splines of the pixel centres about x = floor(x) + t, from the one at floor(x) − 2 to that at floor(x) + 3.
/// Recursion over the degree d:  d B_d(x) = x B_{d−1}(x) + (d + 1 − x) B_{d−1}(x − 1),  at x = t + m.
Weights spline_weights(double t) {
  Weights value{};
  value[0] = 1;
  for (int d = 1; d <= degree; ++d)
    for (int m = d; m >= 0; --m)
      value[m] = ((m < d ? (t + m) * value[m] : 0) + (m > 0 ? (d + 1 - t - m) * value[m - 1] : 0)) / d;
  std::reverse(value.begin(), value.end());
  return value;
}

void deposit_spline(double* plane, int width, int height, const Eigen::Vector2d& point) {
  const Eigen::Vector2d p = point.array() - 0.5;  // Pixel centres at integers.
  const int x = static_cast<int>(std::floor(p.x())), y = static_cast<int>(std::floor(p.y()));
  const Weights wx = spline_weights(p.x() - x), wy = spline_weights(p.y() - y);
  const int left = x - degree / 2, top = y - degree / 2;
  if (left >= 0 && top >= 0 && left + degree < width && top + degree < height) {
    double* row = plane + static_cast<std::size_t>(top) * width + left;
    for (int j = 0; j <= degree; ++j, row += width)
      for (int i = 0; i <= degree; ++i) row[i] += wy[j] * wx[i];
    return;
  }
  for (int j = 0; j <= degree; ++j) {
    double* row = plane + static_cast<std::size_t>(mirror(top + j, height)) * width;
    for (int i = 0; i <= degree; ++i) row[mirror(left + i, width)] += wy[j] * wx[i];
  }
}

/// The Gaussian about `center` at the pixel centres around it, with sum 1.
int gaussian_weights(double center, double tau, std::vector<double>& weights) {
  const int first = static_cast<int>(std::ceil(center - 0.5 - cut_off * tau - 0.5));
  const int last = static_cast<int>(std::floor(center - 0.5 + cut_off * tau + 0.5));
  weights.resize(last - first + 1);
  double sum = 0;
  for (int i = first; i <= last; ++i) {
    const double d = (i + 0.5 - center) / tau;
    sum += weights[i - first] = std::exp(-d * d / 2);
  }
  for (double& weight : weights) weight /= sum;
  return first;
}

void deposit_gaussian(double* plane, int width, int height, const Eigen::Vector2d& point, double tau) {
  thread_local std::vector<double> wx, wy;
  const int x = gaussian_weights(point.x(), tau, wx), y = gaussian_weights(point.y(), tau, wy);
  for (std::size_t j = 0; j < wy.size(); ++j) {
    double* row = plane + static_cast<std::size_t>(mirror(y + static_cast<int>(j), height)) * width;
    for (std::size_t i = 0; i < wx.size(); ++i) row[mirror(x + static_cast<int>(i), width)] += wy[j] * wx[i];
  }
}

/// The filter k, indices −radius … radius, for which Σ k[n − m] B(x − m) interpolates the Gaussian at the integers: the
/// sampled Gaussian divided by the sampled B-spline, as Fourier series (of period 2 radius; both are even).
std::vector<double> spline_filter(double tau) {
  constexpr double pi = 3.14159265358979323846;
  const int radius = static_cast<int>(std::ceil(cut_off * tau)) + 12;
  const Weights b = spline_weights(0);  // B(2), B(1), B(0), B(-1), B(-2) and 0.
  std::vector<double> ratio(radius + 1), filter(2 * radius + 1);
  for (int f = 0; f <= radius; ++f) {
    const double angle = pi * f / radius;
    double gaussian = 1;
    for (int n = 1; n < radius; ++n) gaussian += 2 * std::exp(-0.5 * n * n / (tau * tau)) * std::cos(angle * n);
    ratio[f] = gaussian / (b[2] + 2 * b[1] * std::cos(angle) + 2 * b[0] * std::cos(2 * angle));
  }
  double sum = 0;
  for (int n = -radius; n <= radius; ++n) {
    double value = ratio[0] + ratio[radius] * std::cos(pi * n);
    for (int f = 1; f < radius; ++f) value += 2 * ratio[f] * std::cos(pi * f * n / radius);
    sum += filter[n + radius] = value;
  }
  for (double& value : filter) value /= sum;
  return filter;
}

/// Convolves a line of `count` values in place; its edges mirror it.
void filter_line(double* line, int count, const std::vector<double>& filter, std::vector<double>& padded) {
  const int radius = static_cast<int>(filter.size() / 2);
  padded.resize(count + 2 * radius);
  for (int i = -radius; i < count + radius; ++i)
    padded[i + radius] = i >= 0 && i < count ? line[i] : line[mirror(i, count)];
  std::fill_n(line, count, 0.0);
  for (std::size_t k = 0; k < filter.size(); ++k)
    for (int i = 0; i < count; ++i) line[i] += filter[k] * padded[i + k];
}

/// Convolves the columns of a plane, a strip of them at a time so that rows are read in order.
void filter_columns(double* plane, int width, int height, int first, int last, const std::vector<double>& filter) {
  const int radius = static_cast<int>(filter.size() / 2), strip = last - first;
  std::vector<double> source(static_cast<std::size_t>(height) * strip);
  for (int y = 0; y < height; ++y)
    std::copy_n(plane + static_cast<std::size_t>(y) * width + first, strip,
                &source[static_cast<std::size_t>(y) * strip]);
  for (int y = 0; y < height; ++y) {
    double* row = plane + static_cast<std::size_t>(y) * width + first;
    std::fill_n(row, strip, 0.0);
    for (std::size_t k = 0; k < filter.size(); ++k) {
      const double* from = &source[static_cast<std::size_t>(mirror(y + static_cast<int>(k) - radius, height)) * strip];
      for (int i = 0; i < strip; ++i) row[i] += filter[k] * from[i];
    }
  }
}

void filter_plane(double* plane, int width, int height, const std::vector<double>& filter) {
  tbb::parallel_for(0, height, [&](int y) {
    thread_local std::vector<double> padded;
    filter_line(plane + static_cast<std::size_t>(y) * width, width, filter, padded);
  });
  constexpr int strip = 64;
  tbb::parallel_for(0, (width + strip - 1) / strip, [&](int i) {
    filter_columns(plane, width, height, i * strip, std::min((i + 1) * strip, width), filter);
  });
}

bool uses_splines(const DensitySettings& settings) {
  return settings.kind == DensityKind::gaussian && settings.tau >= smallest_spline_tau;
}

}  // namespace

DensityEstimator::DensityEstimator(int width, int height, int channels, const DensitySettings& settings)
    : settings_(settings) {
  if (width < 1 || height < 1 || channels < 1)
    throw std::invalid_argument("a density estimate needs at least one pixel and one channel");
  if (!(settings.tau >= 0.3 && settings.tau <= 1000))
    throw std::invalid_argument("the width tau of the density estimate must be between 0.3 and 1000 pixels");
  film_ = Film(width, height, channels);
}

void DensityEstimator::add(int channel, const std::vector<Eigen::Vector2d>& points) {
  double* plane = film_.plane(channel);
  const int width = film_.width, height = film_.height;
  for (const Eigen::Vector2d& point : points) {
    if (settings_.kind == DensityKind::histogram) {
      const int x = std::clamp(static_cast<int>(point.x()), 0, width - 1);
      const int y = std::clamp(static_cast<int>(point.y()), 0, height - 1);
      plane[static_cast<std::size_t>(y) * width + x] += 1;
    } else if (uses_splines(settings_)) {
      deposit_spline(plane, width, height, point);
    } else {
      deposit_gaussian(plane, width, height, point, settings_.tau);
    }
  }
}

Film DensityEstimator::finish() && {
  if (uses_splines(settings_)) {
    const std::vector<double> filter = spline_filter(settings_.tau);
    for (int channel = 0; channel < film_.channels; ++channel)
      filter_plane(film_.plane(channel), film_.width, film_.height, filter);
  }
  return std::move(film_);
}

}  // namespace tensorray
