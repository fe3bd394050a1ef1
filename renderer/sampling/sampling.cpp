#include "renderer/sampling/sampling.h"

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "base/constants.h"
#include "renderer/sampling/random.h"

namespace tensorray {
namespace {

/// The seed of the sequence of the current dimension: the 53 random bits of the hash.
std::uint64_t sequence_seed(const PathSampler& path) {
  return static_cast<std::uint64_t>(random_uniform(path.key, path.dimension) * 0x1p53);
}

/// Keys of a path's other sequences, unlike those of its dimensions, which are below 2^32. A sequence may use four.
std::uint64_t sequence_key(const PathSampler& path, int number) {
  return path.key + (std::uint64_t{1} << 32) + 4 * static_cast<std::uint64_t>(number);
}

Eigen::Vector2d vector(const std::array<double, 2>& pair) { return {pair[0], pair[1]}; }

/// The direction about +z with 1 − cos θ = `height`. cos θ is not accurate enough for small angles.
Eigen::Vector3d direction_at(double height, double turn) {
  const double across = std::sqrt(std::max(0.0, height * (2 - height)));
  const Eigen::Vector2d place = across * circle_at(turn);
  return {place.x(), place.y(), 1 - height};
}

std::vector<Distribution1D> make_rows(const std::vector<double>& values, int width, int height) {
  if (width < 1 || height < 1 || values.size() != static_cast<std::size_t>(width) * height)
    throw std::invalid_argument("a distribution of " + std::to_string(width) + " x " + std::to_string(height) +
                                " cells cannot have " + std::to_string(values.size()) + " values");
  std::vector<Distribution1D> rows;
  rows.reserve(height);
  for (auto row = values.begin(); row != values.end(); row += width)
    rows.emplace_back(std::vector<double>(row, row + width));
  return rows;
}

std::vector<double> sums(const std::vector<Distribution1D>& rows) {
  std::vector<double> result;
  for (const Distribution1D& row : rows) result.push_back(row.sum());
  return result;
}

}  // namespace

PathSampler::PathSampler(std::uint64_t seed, std::uint64_t pixel_, std::uint32_t sample_, std::uint32_t dimension_)
    : pixel(pixel_), sample(sample_), dimension(dimension_), key(random_key(seed, pixel_)) {}

double PathSampler::next_1d() {
  const std::uint64_t sequence = sequence_seed(*this);
  ++dimension;
  return sobol(sequence, sample, 0);
}

Eigen::Vector2d PathSampler::next_2d() {
  const std::uint64_t sequence = sequence_seed(*this);
  ++dimension;
  return vector(sobol_pair(sequence, sample));
}

Eigen::Vector2d PathSampler::in_pixel() const { return vector(joint_sobol_start(sequence_key(*this, 0), sample)); }

SurfaceNumbers PathSampler::at_surface(int depth) const {
  const std::uint64_t sequence = sequence_key(*this, depth);
  const SobolTwins twins = depth == 1 ? joint_sobol_twins(sequence, sample) : sobol_twins(sequence, sample);
  return {vector(twins.first), vector(twins.second)};
}

Eigen::Matrix3d frame_about(const Eigen::Vector3d& axis) {
  const double sign = std::copysign(1.0, axis.z());
  const double a = -1 / (sign + axis.z()), b = axis.x() * axis.y() * a;
  Eigen::Matrix3d frame;
  frame.col(0) << 1 + sign * axis.x() * axis.x() * a, sign * b, -sign * axis.x();
  frame.col(1) << b, sign + axis.y() * axis.y() * a, -axis.y();
  frame.col(2) = axis;
  return frame;
}

Eigen::Vector2d circle_at(double turn) {
  // Taylor's series for the angle from the nearest quarter turn: the next terms are below 1e-15.
  const int quarter = static_cast<int>(4 * turn + 8.5) - 8;
  const double angle = (turn - 0.25 * quarter) * (2 * pi), x = angle * angle;
  const double x2 = x * x, x4 = x2 * x2;
  const double sine = angle * ((1 - x / 6) + x2 * (1.0 / 120 - x / 5040) +
                               x4 * ((1.0 / 362880 - x / 39916800) + x2 * (1.0 / 6227020800 - x / 1307674368000)));
  const double cosine = (1 - x / 2) + x2 * (1.0 / 24 - x / 720) +
                        x4 * ((1.0 / 40320 - x / 3628800) + x2 * (1.0 / 479001600 - x / 87178291200));
  const double along = quarter & 1 ? -sine : cosine, across = quarter & 1 ? cosine : sine;
  return quarter & 2 ? Eigen::Vector2d(-along, -across) : Eigen::Vector2d(along, across);
}

Eigen::Vector2d square_to_disk(const Eigen::Vector2d& u) {
  const Eigen::Vector2d p = 2 * u - Eigen::Vector2d::Ones();
  if (p.isZero(0)) return Eigen::Vector2d::Zero();
  const bool along_x = std::abs(p.x()) > std::abs(p.y());
  const double radius = along_x ? p.x() : p.y();
  return radius * circle_at(along_x ? p.y() / p.x() / 8 : 0.25 - p.x() / p.y() / 8);
}

Eigen::Vector3d square_to_cosine_hemisphere(const Eigen::Vector2d& u) {
  const Eigen::Vector2d p = square_to_disk(u);
  return {p.x(), p.y(), std::sqrt(std::max(0.0, 1 - p.squaredNorm()))};
}

Eigen::Vector3d square_to_sphere(const Eigen::Vector2d& u) { return direction_at(2 * u.x(), u.y()); }

double one_minus_cosine(double angle) { return 2 * std::pow(std::sin(angle / 2), 2); }

Eigen::Vector3d square_to_cap(const Eigen::Vector2d& u, double height) { return direction_at(height * u.x(), u.y()); }

Eigen::Vector3d square_to_cone(const Eigen::Vector2d& u, double angle) {
  return square_to_cap(u, one_minus_cosine(angle));
}

double cone_solid_angle(double angle) { return 2 * pi * one_minus_cosine(angle); }

Eigen::Vector3d square_to_triangle(const Eigen::Vector2d& u) {
  const double half = std::min(u.x(), u.y()) / 2;
  const double b0 = u.x() < u.y() ? half : u.x() - half;
  const double b1 = u.x() < u.y() ? u.y() - half : half;
  return {b0, b1, 1 - b0 - b1};
}

Distribution1D::Distribution1D(const std::vector<double>& values) : cumulative_{0} {
  if (values.empty()) throw std::invalid_argument("a distribution needs at least one value");
  cumulative_.reserve(values.size() + 1);
  for (const double value : values) {
    if (!(value >= 0)) throw std::invalid_argument("the values of a distribution must not be negative");
    cumulative_.push_back(cumulative_.back() + value);
  }
  sum_ = cumulative_.back();
  if (!std::isfinite(sum_)) throw std::invalid_argument("the values of a distribution must be finite, and their sum");
  // Treat sums below the smallest normal number as 0: dividing by them would not give probabilities.
  if (sum_ < std::numeric_limits<double>::min()) {
    for (std::size_t i = 0; i < cumulative_.size(); ++i)
      cumulative_[i] = static_cast<double>(i) / static_cast<double>(values.size());
  } else {
    for (double& value : cumulative_) value /= sum_;
  }
}

Distribution1D::Sample Distribution1D::sample(double u) const {
  const auto end = std::upper_bound(cumulative_.begin() + 1, cumulative_.end() - 1, u);
  const int cell = static_cast<int>(end - cumulative_.begin()) - 1;
  const double share = probability(cell);
  constexpr double below_one = 1 - std::numeric_limits<double>::epsilon() / 2;
  return {cell, share > 0 ? std::min((u - cumulative_[cell]) / share, below_one) : 0, share};
}

Distribution2D::Distribution2D(const std::vector<double>& values, int width, int height)
    : rows_(make_rows(values, width, height)), column_(sums(rows_)) {}

Distribution2D::Sample Distribution2D::sample(const Eigen::Vector2d& u) const {
  const Distribution1D::Sample row = column_.sample(u.y());
  const Distribution1D::Sample cell = rows_[row.cell].sample(u.x());
  return {{cell.cell, row.cell}, {cell.within, row.within}, cell.probability * row.probability};
}

double Distribution2D::probability(const Eigen::Vector2i& cell) const {
  return column_.probability(cell.y()) * rows_[cell.y()].probability(cell.x());
}

}  // namespace tensorray
