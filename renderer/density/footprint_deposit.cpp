#include "renderer/density/footprint_deposit.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "renderer/density/mirror.h"

namespace tensorray {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double units = 1.7179869184e10;  // 2^34.
constexpr double narrowest = 0.4;          // Pixels.
constexpr double widest = 1.0 / 16;        // Of the plate's longer side.
constexpr double reach_in_deviations = 3;  // Standard deviations.

struct Tap {
  int x, y;
  double weight;
};

/// The inverse of a Gaussian's covariance.
Matrix2d precision_of(const Matrix2d& axes, double most) {
  const Matrix2d finite = axes.allFinite() ? axes : Matrix2d::Zero();
  Eigen::SelfAdjointEigenSolver<Matrix2d> solver;
  solver.computeDirect(finite * finite.transpose());
  const Eigen::Array2d variances = solver.eigenvalues().array().max(0.0).min(most * most) + narrowest * narrowest;
  return solver.eigenvectors() * variances.inverse().matrix().asDiagonal() * solver.eigenvectors().transpose();
}

/// The Gaussian at the middles of pixels, to the cut-off, with the sum 1.
void find_taps(const Vector2d& at, const Matrix2d& precision, std::vector<Tap>& taps) {
  taps.clear();
  const double a = precision(0, 0), b = precision(0, 1), c = precision(1, 1), determinant = a * c - b * b;
  const double reach = reach_in_deviations * std::sqrt(a / determinant);
  double sum = 0;
  for (int y = static_cast<int>(std::floor(at.y() - reach)); y + 0.5 <= at.y() + reach; ++y) {
    // a x² + 2 b x dy + c dy² = reach_in_deviations² at the ends of the row.
    const double dy = y + 0.5 - at.y(), middle = -b / a * dy;
    const double half =
        std::sqrt(std::max((reach_in_deviations * reach_in_deviations - determinant / a * dy * dy) / a, 0.0));
    const auto last = static_cast<int>(std::floor(at.x() + middle + half - 0.5));
    for (int x = static_cast<int>(std::ceil(at.x() + middle - half - 0.5)); x <= last; ++x) {
      const double dx = x + 0.5 - at.x();
      taps.push_back({x, y, std::exp(-0.5 * (a * dx * dx + 2 * b * dx * dy + c * dy * dy))});
      sum += taps.back().weight;
    }
  }
  for (Tap& tap : taps) tap.weight /= sum;
}

}  // namespace

FootprintDeposit::FootprintDeposit(int width, int height, int channels, const std::vector<Eigen::Vector3d>& colors)
    : width_(width),
      height_(height),
      channels_(channels),
      colors_(colors),
      sums_(static_cast<std::size_t>(std::max(width, 0)) * std::max(height, 0) * (colors.empty() ? channels : 3)) {
  if (width < 1 || height < 1 || channels < 1)
    throw std::invalid_argument("photons need at least one pixel and one channel");
  if (!colors.empty() && colors.size() != static_cast<std::size_t>(channels))
    throw std::invalid_argument("photons in colour need a colour for each channel");
}

void FootprintDeposit::add_to_pixel(int channel, int x, int y, double weight) {
  const std::size_t plane = static_cast<std::size_t>(width_) * height_;
  const std::size_t pixel = static_cast<std::size_t>(mirror(y, height_)) * width_ + mirror(x, width_);
  const auto add = [&](std::size_t index, double value) {
    sums_[index].fetch_add(std::llround(units * value), std::memory_order_relaxed);
  };
  if (colors_.empty()) return add(channel * plane + pixel, weight);
  for (int k = 0; k < 3; ++k) add(k * plane + pixel, weight * colors_[channel][k]);
}

void FootprintDeposit::add(int channel, const Vector2d& at, const Matrix2d& axes) {
  thread_local std::vector<Tap> taps;
  find_taps(at, precision_of(axes, widest * std::max(width_, height_)), taps);
  for (const Tap& tap : taps) add_to_pixel(channel, tap.x, tap.y, tap.weight);
}

void FootprintDeposit::copy_sums(Archive& archive) {
  archive.require(archive.reads() ? sums_.size() : 0, sizeof(std::int64_t));
  for (auto& sum : sums_) {
    std::int64_t value = archive.reads() ? 0 : sum.load(std::memory_order_relaxed);
    archive.copy(value);
    if (archive.reads()) sum.fetch_add(value, std::memory_order_relaxed);
  }
}

Film FootprintDeposit::finish(double weight) const {
  Film film(width_, height_, colors_.empty() ? channels_ : 3);
  for (std::size_t i = 0; i < sums_.size(); ++i)
    film.values[i] = weight / units * static_cast<double>(sums_[i].load(std::memory_order_relaxed));
  return film;
}

}  // namespace tensorray
