#pragma once
/// Hypothesis tests, and means with standard errors.

#include <cstddef>

#include "tests/names.h"

namespace tensorray {

/// Chi-square of counts, whose expectation is proportional to `weights`, in standard deviations from its mean (normal
/// for many bins). Bins with fewer than 8 expected counts are merged into one. A count where the weight is 0 gives
/// infinity.
inline double chi_square_score(const std::vector<int>& counts, const std::vector<double>& weights) {
  double total = 0, weight = 0, sum = 0, freedom = -1, rare_count = 0, rare_expected = 0;
  for (const int count : counts) total += count;
  for (const double w : weights) weight += w;
  const auto add = [&](double count, double expected) {
    sum += (count - expected) * (count - expected) / expected;
    freedom += 1;
  };
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double expected = total * weights[i] / weight;
    if (weights[i] == 0 && counts[i] > 0) return INFINITY;
    if (expected >= 8) {
      add(counts[i], expected);
    } else {
      rare_count += counts[i];
      rare_expected += expected;
    }
  }
  if (rare_expected >= 8) add(rare_count, rare_expected);
  return (sum - freedom) / std::sqrt(2 * std::max(1.0, freedom));
}

/// The score of 65,536 points in 32 x 32 bins of the unit square. Points on the right and upper edges count in the last
/// bins.
template <class Point>
double square_score(const Point& point) {
  std::vector<int> counts(32 * 32);
  const auto bin = [](double x) { return std::min(static_cast<int>(x * 32), 31); };
  for (int i = 0; i < 65536; ++i) {
    const Eigen::Vector2d p = point(i);
    EXPECT_GE(p.minCoeff(), 0);
    EXPECT_LE(p.maxCoeff(), 1 + 1e-12);
    ++counts[static_cast<std::size_t>(bin(p.x()) * 32 + bin(p.y()))];
  }
  return chi_square_score(counts, std::vector<double>(counts.size(), 1.0));
}

/// The mean of independent values, and its standard error.
class Mean {
 public:
  void add(double value) {
    ++count_;
    const double change = value - mean_;
    mean_ += change / count_;
    squares_ += change * (value - mean_);
  }
  double count() const { return count_; }
  double mean() const { return mean_; }
  double error() const { return std::sqrt(squares_ / (count_ - 1) / count_); }

 private:
  double count_ = 0, mean_ = 0, squares_ = 0;
};

}  // namespace tensorray
