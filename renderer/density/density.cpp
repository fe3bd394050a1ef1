#include "renderer/density/density.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>

#include "base/constants.h"
#include "renderer/density/convolution.h"
#include "renderer/density/mirror.h"

namespace tensorray {
namespace {

constexpr double smallest_spline_tau = 2;  // For less the spline interpolant of the Gaussian is not accurate enough.
constexpr double cut_off = 4.5;            // In units of tau; the Gaussian is 4e-5 of its peak there.
constexpr std::size_t most_buckets = 1u << 14;  // Largest number of buckets to sort points into.
constexpr int largest_size = 65000;             // Largest width and height: columns and rows of points are 16 bits.
constexpr int fraction_bits = 26;               // Of what a point adds to a pixel, as a part of the brightest colour.

bool uses_splines(const DensitySettings& settings) {
  return settings.kind == DensityKind::gaussian && settings.tau >= smallest_spline_tau;
}

/// The filter k, for indices −radius … radius, for which Σ k[n − m] B(x − m) interpolates the Gaussian at the integers.
/// As Fourier series it is the sampled Gaussian divided by the sampled B-spline (the period is 2 radius; both are
/// even).
std::vector<double> spline_filter(double tau) {
  constexpr double b[] = {66.0 / 120, 26.0 / 120, 1.0 / 120};  // The quintic B-spline at 0, 1 and 2.
  const int radius = static_cast<int>(std::ceil(cut_off * tau)) + 12;
  std::vector<double> ratio(radius + 1), filter(2 * radius + 1);
  for (int f = 0; f <= radius; ++f) {
    const double angle = pi * f / radius;
    double gaussian = 1;
    for (int n = 1; n < radius; ++n) gaussian += 2 * std::exp(-0.5 * n * n / (tau * tau)) * std::cos(angle * n);
    ratio[f] = gaussian / (b[0] + 2 * b[1] * std::cos(angle) + 2 * b[2] * std::cos(2 * angle));
  }
  double sum = 0;
  for (int n = 0; n <= radius; ++n) {
    double value = ratio[0] + ratio[radius] * std::cos(pi * n);
    for (int f = 1; f < radius; ++f) value += 2 * ratio[f] * std::cos(pi * f * n / radius);
    filter[radius - n] = filter[radius + n] = value;
    sum += n > 0 ? 2 * value : value;
  }
  for (double& value : filter) value /= sum;
  return filter;
}

/// Convolves a line of `count` values, which is mirrored at its ends.
void filter_line(double* line, int count, const std::vector<double>& filter) {
  thread_local std::vector<double> padded, result;
  const int radius = static_cast<int>(filter.size() / 2);
  const std::size_t room = convolution_room(count);
  padded.resize(room + 2 * radius);
  result.resize(room);
  std::copy_n(line, count, &padded[radius]);
  for (int i = -radius; i < 0; ++i) padded[i + radius] = line[mirror(i, count)];
  for (int i = count; i < count + radius; ++i) padded[i + radius] = line[mirror(i, count)];
  convolve(padded.data(), 1, filter, result.data(), count);
  std::copy_n(result.data(), count, line);
}

/// Convolves the columns [first, last) of a plane, which is mirrored at its upper and lower edges.
void filter_columns(double* plane, int width, int height, int first, int last, const std::vector<double>& filter) {
  thread_local std::vector<double> padded, result;
  const int radius = static_cast<int>(filter.size() / 2), count = last - first;
  const std::size_t room = convolution_room(count);
  padded.resize((height + 2 * radius) * room);
  result.resize(room);
  for (int y = -radius; y < height + radius; ++y)
    std::copy_n(plane + static_cast<std::size_t>(mirror(y, height)) * width + first, count,
                &padded[(y + radius) * room]);
  for (int y = 0; y < height; ++y) {
    convolve(&padded[y * room], room, filter, result.data(), count);
    std::copy_n(result.data(), count, plane + static_cast<std::size_t>(y) * width + first);
  }
}

void filter_columns(Film& film, const std::vector<double>& filter) {
  constexpr int strip = 64;
  const int strips = (film.width + strip - 1) / strip;
  tbb::parallel_for(0, film.channels * strips, [&](int task) {
    const int first = task % strips * strip;
    filter_columns(film.plane(task / strips), film.width, film.height, first, std::min(first + strip, film.width),
                   filter);
  });
}

/// Chooses the size of the tiles. A tile is at least as wide as a kernel, so that the kernels of two tiles with a third
/// tile between them do not overlap. A small tile and its margin fit into a cache. Many tiles give all threads work
/// even if the light is concentrated in a few places.
PointBucketing make_bucketing(int width, int height, int planes, int least_tile_bits, int taps) {
  PointBucketing bucketing;
  bucketing.planes = static_cast<std::uint32_t>(planes);
  for (int bits = least_tile_bits;; ++bits) {
    bucketing.tile_bits = bits;
    bucketing.columns = static_cast<std::uint32_t>(width >> bits) + 1;  // Columns of points go from 0 to width.
    bucketing.rows = static_cast<std::uint32_t>(height >> bits) + 1;
    const bool is_one = bucketing.tiles() == 1;
    if ((1 << bits) >= taps && (is_one || std::size_t{bucketing.tiles()} * planes <= most_buckets)) return bucketing;
  }
}

/// 2^-26, or 2^-26 of the power of two above the largest component of a colour.
double quantum_of(const std::vector<Eigen::Vector3d>& colors) {
  double largest = 0;
  for (const Eigen::Vector3d& color : colors) largest = std::max(largest, color.cwiseAbs().maxCoeff());
  int exponent = 0;
  std::frexp(largest, &exponent);
  return std::ldexp(1.0, exponent - fraction_bits);
}

/// For each row of a plate, the rows of the plane with margins that fall on it.
std::vector<std::vector<int>> mirrored_rows(int height, int margin) {
  std::vector<std::vector<int>> rows(height);
  for (int y = -margin; y < height + margin; ++y) rows[mirror(y, height)].push_back(y + margin);
  return rows;
}

void check(int width, int height, int channels, const DensitySettings& settings,
           const std::vector<Eigen::Vector3d>& colors) {
  if (width < 1 || height < 1 || channels < 1)
    throw std::invalid_argument("a density estimate needs at least one pixel and one channel");
  if (width > largest_size || height > largest_size || channels >= DensityPoint::nowhere)
    throw std::invalid_argument("a density estimate has at most 65000 x 65000 pixels and 65534 channels");
  if (!(settings.tau >= 0.3 && settings.tau <= 1000))
    throw std::invalid_argument("the width tau of the density estimate must be between 0.3 and 1000 pixels");
  if (settings.kind == DensityKind::photon_differential)
    throw std::invalid_argument("photon differentials are deposited by FootprintDeposit");
  if (!colors.empty() && colors.size() != static_cast<std::size_t>(channels))
    throw std::invalid_argument("a density estimate in colour needs a colour for each channel");
}

}  // namespace

DensityEstimator::DensityEstimator(int width, int height, int channels, const DensitySettings& settings,
                                   const std::vector<Eigen::Vector3d>& colors)
    : settings_(settings), width_(width), height_(height), channels_(channels) {
  check(width, height, channels, settings, colors);
  for (const Eigen::Vector3d& color : colors) colors_.push_back({{color.x(), color.y(), color.z(), 0}});
  quantum_ = quantum_of(colors);
  int taps = 1;
  if (uses_splines(settings)) {
    taps = spline_taps;
  } else if (settings.kind == DensityKind::gaussian) {
    gaussian_.emplace(settings.tau, cut_off * settings.tau + 0.5);
    taps = gaussian_->taps();
  }
  margin_ = taps / 2;
  const bool is_colored = !colors_.empty();
  const int planes = is_colored ? 1 : channels;
  bucketing_ = make_bucketing(width, height, planes, is_colored ? 5 : 7, taps);
  const std::size_t values = (is_colored ? 4 : planes) * plane_size();
  sums_.resize((values + 3) / 4);
}

/// Number of pixels of a plane, including the margins.
std::size_t DensityEstimator::plane_size() const {
  return static_cast<std::size_t>(width_ + 2 * margin_) * (height_ + 2 * margin_);
}

DensityPoint DensityEstimator::point(int channel, const Eigen::Vector2d& at) const {
  DensityPoint point;
  point.channel = static_cast<std::uint16_t>(channel);
  if (settings_.kind == DensityKind::histogram) {
    point.column = static_cast<std::uint16_t>(std::clamp(static_cast<int>(at.x()), 0, width_ - 1));
    point.row = static_cast<std::uint16_t>(std::clamp(static_cast<int>(at.y()), 0, height_ - 1));
    return point;
  }
  // Count pixels from the one before the first: column 0 is pixel −1. Its kernel begins where the margin begins.
  const int column = std::min(static_cast<int>(at.x() + 0.5), width_),
            row = std::min(static_cast<int>(at.y() + 0.5), height_);
  point.column = static_cast<std::uint16_t>(column);
  point.row = static_cast<std::uint16_t>(row);
  point.x = static_cast<float>(at.x() + 0.5 - column);
  point.y = static_cast<float>(at.y() + 0.5 - row);
  return point;
}

/// Adds tiles in four passes of every second tile along both axes: within a pass the kernels of different tiles do not
/// overlap, so that tiles can be filled at the same time.
void DensityEstimator::add(const std::vector<DensityPoint>& points) {
  sort_into_buckets(points, bucketing_, buckets_);
  for (const std::uint32_t first : {0u, 1u, 2u, 3u}) {
    const std::uint32_t right = first % 2, down = first / 2;
    const std::uint32_t columns = (bucketing_.columns + 1 - right) / 2, rows = (bucketing_.rows + 1 - down) / 2;
    const auto deposit_tile = [&](std::uint32_t task) {
      const std::uint32_t plane = task / (rows * columns), row = 2 * (task / columns % rows) + down;
      deposit((plane * bucketing_.rows + row) * bucketing_.columns + 2 * (task % columns) + right);
    };
    // One task per tile: tiles with many points are often neighbours and should not fall to the same thread.
    tbb::parallel_for(std::uint32_t{0}, bucketing_.planes * rows * columns, deposit_tile, tbb::simple_partitioner());
  }
}

void DensityEstimator::deposit(std::uint32_t bucket) {
  const std::size_t first = buckets_.begin[bucket], last = buckets_.begin[bucket + 1];
  DepositTarget target;
  target.rounding = 1.5 * (std::uint64_t{1} << 52) * quantum_;
  target.width = width_ + 2 * margin_;
  target.colors = colors_.empty() ? nullptr : colors_.data();
  target.pixels = &sums_[0].values[0] + (colors_.empty() ? bucket / bucketing_.tiles() * plane_size() : 0);
  if (uses_splines(settings_)) {
    deposit_splines(buckets_.points, first, last, target);
  } else if (gaussian_) {
    deposit_gaussians(buckets_.points, first, last, *gaussian_, target);
  } else {
    deposit_counts(buckets_.points, first, last, target);
  }
}

void DensityEstimator::copy_sums(Archive& archive) { archive.copy_sums(&sums_[0].values[0], 4 * sums_.size()); }

Film DensityEstimator::finish(double weight) const {
  const std::vector<std::vector<int>> rows = mirrored_rows(height_, margin_);
  const bool is_colored = !colors_.empty();
  const std::vector<double> filter = uses_splines(settings_) ? spline_filter(settings_.tau) : std::vector<double>();
  Film film(width_, height_, is_colored ? 3 : channels_);
  const std::size_t step = is_colored ? 4 : 1, row_pixels = width_ + 2 * margin_;
  tbb::parallel_for(0, film.channels * height_, [&](int task) {
    const int channel = task / height_, y = task % height_;
    const double* const plane = &sums_[0].values[0] + (is_colored ? channel : channel * plane_size());
    double* const line = film.plane(channel) + static_cast<std::size_t>(y) * width_;
    for (const int from : rows[y]) {
      const double* const row = plane + from * row_pixels * step;
      for (int x = -margin_; x < width_ + margin_; ++x) line[mirror(x, width_)] += weight * row[(x + margin_) * step];
    }
    if (!filter.empty()) filter_line(line, width_, filter);
  });
  if (!filter.empty()) filter_columns(film, filter);
  return film;
}

}  // namespace tensorray
