#pragma once
/// @file tests/renderer/statistics.h
/// Hypothesis tests, and means with standard errors.

#include <cmath>
#include <cstddef>
#include <vector>

namespace tensorray {

/// Chi-square of counts, whose expectation is proportional to `weights`, in standard deviations from its mean (normal
/// for many bins). A count where the weight is 0 gives infinity.
inline double chi_square_score(const std::vector<int>& counts, const std::vector<double>& weights) {
  double total = 0, weight = 0, sum = 0, freedom = -1;
  for (const int count : counts) total += count;
  for (const double w : weights) weight += w;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (weights[i] == 0 && counts[i] == 0) continue;
    const double expected = total * weights[i] / weight;
    sum += (counts[i] - expected) * (counts[i] - expected) / expected;
    freedom += 1;
  }
  return (sum - freedom) / std::sqrt(2 * freedom);
}

/// As above, for counts that should be equal.
inline double chi_square_score(const std::vector<int>& counts) {
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
  double mean() const { return mean_; }
  double error() const { return std::sqrt(squares_ / (count_ - 1) / count_); }

 private:
  double count_ = 0, mean_ = 0, squares_ = 0;
};

}  // namespace tensorray
