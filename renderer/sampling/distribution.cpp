#include "renderer/sampling/distribution.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace tensorray {
namespace {

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
