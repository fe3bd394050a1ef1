#include "renderer/density/density.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double units = 1.7179869184e10;  // 2^34.
constexpr double min_blurred_tau = 2;      // For less the spline is not narrow enough beside the Gaussian.
constexpr double spline_variance = 1.0 / 3;
constexpr double gaussian_reach = 4.5;  // Standard deviations; the Gaussian is 4e-5 of its peak there.
constexpr double footprint_reach = 3;   // Standard deviations.
constexpr double narrowest = 0.4;       // Footprint, pixels.
constexpr double widest = 1.0 / 16;     // Footprint; of the plate's longer side.
constexpr int largest_size = 65000;     // Width and height.

/// What a photon adds to a pixel, which may be beside the plate.
struct Tap {
  int x, y;
  double weight;
};

bool is_blurred(const DensitySettings& settings) {
  return settings.kind == DensityKind::gaussian && settings.tau >= min_blurred_tau;
}

/// Reflects an index into [0, size), as mirrors at the outer edges of the first and last pixel would.
int mirror(int index, int size) {
  const int period = 2 * size;
  index = ((index % period) + period) % period;
  return index < size ? index : period - 1 - index;
}

/// The cubic B-spline about a place along an axis, at the middles of four pixels. @return the first of them.
int spline_weights(double at, std::array<double, 4>& weights) {
  const double first = std::floor(at - 0.5), t = at - 0.5 - first, rest = 1 - t;
  weights = {rest * rest * rest / 6, (4 - 6 * t * t + 3 * t * t * t) / 6,
             (4 - 6 * rest * rest + 3 * rest * rest * rest) / 6, t * t * t / 6};
  return static_cast<int>(first) - 1;
}

void find_spline_taps(const Vector2d& at, std::vector<Tap>& taps) {
  std::array<double, 4> columns, rows;
  const int x = spline_weights(at.x(), columns), y = spline_weights(at.y(), rows);
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) taps.push_back({x + i, y + j, columns[i] * rows[j]});
}

/// The Gaussian at the middles of pixels, to the cut-off, with the sum 1.
/// @param precision  The inverse of its covariance. @param cut_off  Standard deviations.
void find_gaussian_taps(const Vector2d& at, const Matrix2d& precision, double cut_off, std::vector<Tap>& taps) {
  const double a = precision(0, 0), b = precision(0, 1), c = precision(1, 1), determinant = a * c - b * b;
  const double reach = cut_off * std::sqrt(a / determinant);
  double sum = 0;
  for (int y = static_cast<int>(std::floor(at.y() - reach)); y + 0.5 <= at.y() + reach; ++y) {
    // a x² + 2 b x dy + c dy² = cut_off² at the ends of the row.
    const double dy = y + 0.5 - at.y(), middle = -b / a * dy;
    const double half = std::sqrt(std::max((cut_off * cut_off - determinant / a * dy * dy) / a, 0.0));
    const auto last = static_cast<int>(std::floor(at.x() + middle + half - 0.5));
    for (int x = static_cast<int>(std::ceil(at.x() + middle - half - 0.5)); x <= last; ++x) {
      const double dx = x + 0.5 - at.x();
      taps.push_back({x, y, std::exp(-0.5 * (a * dx * dx + 2 * b * dx * dy + c * dy * dy))});
      sum += taps.back().weight;
    }
  }
  for (Tap& tap : taps) tap.weight /= sum;
}

Matrix2d footprint_precision(const Matrix2d& axes, double most) {
  const Matrix2d finite = axes.allFinite() ? axes : Matrix2d::Zero();
  Eigen::SelfAdjointEigenSolver<Matrix2d> solver;
  solver.computeDirect(finite * finite.transpose());
  const Eigen::Array2d variances = solver.eigenvalues().array().max(0.0).min(most * most) + narrowest * narrowest;
  return solver.eigenvectors() * variances.inverse().matrix().asDiagonal() * solver.eigenvectors().transpose();
}

/// A Gaussian at the integers, from its middle on; with its other half, the sum is 1.
std::vector<double> half_filter(double tau) {
  std::vector<double> filter;
  double sum = -1;
  for (int i = 0; i <= gaussian_reach * tau; ++i) {
    filter.push_back(std::exp(-0.5 * i * i / (tau * tau)));
    sum += 2 * filter.back();
  }
  for (double& value : filter) value /= sum;
  return filter;
}

void add_pair(double factor, const double* a, const double* b, int count, double* sum) {
  for (int i = 0; i < count; ++i) sum[i] += factor * (a[i] + b[i]);
}

/// Blurs the rows of a film, and then its columns. It is mirrored at its edges.
void blur(Film& film, const std::vector<double>& filter) {
  const int width = film.width, height = film.height, radius = static_cast<int>(filter.size()) - 1;
  const auto row = [&](Film& in, int task) { return in.plane(task / height) + std::ptrdiff_t{task % height} * width; };
  Film rows = film;
  tbb::parallel_for(0, film.channels * height, [&](int task) {
    thread_local std::vector<double> padded;
    const double* const from = row(film, task);
    double* const to = row(rows, task);
    padded.resize(static_cast<std::size_t>(width) + 2 * radius);
    for (int x = -radius; x < width + radius; ++x) padded[x + radius] = from[mirror(x, width)];
    const double* const middle = padded.data() + radius;
    for (int x = 0; x < width; ++x) to[x] = filter[0] * middle[x];
    for (int k = 1; k <= radius; ++k) add_pair(filter[k], middle - k, middle + k, width, to);
  });
  tbb::parallel_for(0, film.channels * height, [&](int task) {
    const int y = task % height, first = task - y;
    double* const to = row(film, task);
    for (int x = 0; x < width; ++x) to[x] = filter[0] * row(rows, task)[x];
    for (int k = 1; k <= radius; ++k)
      add_pair(filter[k], row(rows, first + mirror(y - k, height)), row(rows, first + mirror(y + k, height)), width,
               to);
  });
}

void check(int width, int height, int channels, const DensitySettings& settings,
           const std::vector<Eigen::Vector3d>& colors) {
  if (width < 1 || height < 1 || channels < 1)
    throw std::invalid_argument("a density estimate needs at least one pixel and one channel");
  if (width > largest_size || height > largest_size)
    throw std::invalid_argument("a density estimate has at most 65000 x 65000 pixels");
  if (!(settings.tau >= 0.3 && settings.tau <= 1000))
    throw std::invalid_argument("the width tau of the density estimate must be between 0.3 and 1000 pixels");
  if (!colors.empty() && colors.size() != static_cast<std::size_t>(channels))
    throw std::invalid_argument("a density estimate in colour needs a colour for each channel");
}

/// Checked before memory is taken.
std::size_t count_sums(int width, int height, int channels, const DensitySettings& settings,
                       const std::vector<Eigen::Vector3d>& colors) {
  check(width, height, channels, settings, colors);
  return static_cast<std::size_t>(width) * height * (colors.empty() ? channels : 3);
}

}  // namespace

DensityEstimator::DensityEstimator(int width, int height, int channels, const DensitySettings& settings,
                                   const std::vector<Eigen::Vector3d>& colors)
    : settings_(settings),
      width_(width),
      height_(height),
      channels_(channels),
      colors_(colors),
      sums_(count_sums(width, height, channels, settings, colors)) {}

void DensityEstimator::add(int channel, const Vector2d& at, const Matrix2d& axes) {
  thread_local std::vector<Tap> taps;
  taps.clear();
  if (settings_.kind == DensityKind::histogram)
    taps.push_back(
        {std::clamp(static_cast<int>(at.x()), 0, width_ - 1), std::clamp(static_cast<int>(at.y()), 0, height_ - 1), 1});
  else if (settings_.kind == DensityKind::photon_differential)
    find_gaussian_taps(at, footprint_precision(axes, widest * std::max(width_, height_)), footprint_reach, taps);
  else if (is_blurred(settings_))
    find_spline_taps(at, taps);
  else
    find_gaussian_taps(at, Matrix2d::Identity() / (settings_.tau * settings_.tau), gaussian_reach, taps);
  for (const Tap& tap : taps) add_to_pixel(channel, tap.x, tap.y, tap.weight);
}

void DensityEstimator::add_to_pixel(int channel, int x, int y, double weight) {
  const std::size_t plane = static_cast<std::size_t>(width_) * height_;
  const std::size_t pixel = static_cast<std::size_t>(mirror(y, height_)) * width_ + mirror(x, width_);
  const auto add = [&](std::size_t index, double value) {
    sums_[index].fetch_add(std::llround(units * value), std::memory_order_relaxed);
  };
  if (colors_.empty()) return add(channel * plane + pixel, weight);
  for (int k = 0; k < 3; ++k) add(k * plane + pixel, weight * colors_[channel][k]);
}

void DensityEstimator::copy_sums(Archive& archive) {
  archive.require(archive.reads() ? sums_.size() : 0, sizeof(std::int64_t));
  for (auto& sum : sums_) {
    std::int64_t value = archive.reads() ? 0 : sum.load(std::memory_order_relaxed);
    archive.copy(value);
    if (archive.reads()) sum.fetch_add(value, std::memory_order_relaxed);
  }
}

Film DensityEstimator::finish(double weight) const {
  Film film(width_, height_, colors_.empty() ? channels_ : 3);
  for (std::size_t i = 0; i < sums_.size(); ++i)
    film.values[i] = weight / units * static_cast<double>(sums_[i].load(std::memory_order_relaxed));
  if (is_blurred(settings_)) blur(film, half_filter(std::sqrt(settings_.tau * settings_.tau - spline_variance)));
  return film;
}

}  // namespace tensorray
