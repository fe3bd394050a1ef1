#include "renderer/sampling/distribution.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "renderer/sampling/random.h"
#include "tests/renderer/statistics.h"

namespace tensorray {
namespace {

TEST(Distribution1D, HasTheProbabilitiesOfItsValues) {
  const std::vector<double> values{0, 3, 1, 0, 0, 4, 0};
  const Distribution1D distribution(values);
  EXPECT_EQ(distribution.sum(), 8);
  std::vector<int> counts(7), within(64);
  for (int i = 0; i < 100000; ++i) {
    const Distribution1D::Sample sample = distribution.sample(random_uniform(1, i, 0));
    ++counts[sample.cell];
    ++within[static_cast<int>(sample.within * 64)];
    ASSERT_EQ(sample.probability, values[sample.cell] / 8);
    ASSERT_EQ(sample.probability, distribution.probability(sample.cell));
  }
  EXPECT_LT(std::abs(chi_square_score(counts, values)), 4);
  EXPECT_LT(std::abs(chi_square_score(within)), 4);
}

TEST(Distribution1D, InvertsTheCumulativeSum) {
  const Distribution1D distribution({0, 3, 1, 0, 0, 4, 0});
  EXPECT_EQ(distribution.sample(0).cell, 1);
  EXPECT_EQ(distribution.sample(0).within, 0);
  EXPECT_EQ(distribution.sample(0.375).cell, 2);
  EXPECT_EQ(distribution.sample(0.4375).within, 0.5);
  EXPECT_EQ(distribution.sample(0.5).cell, 5);
  const Distribution1D::Sample last = distribution.sample(1 - 0x1p-53);
  EXPECT_EQ(last.cell, 5);
  EXPECT_LT(last.within, 1);
}

TEST(Distribution1D, NothingIsEven) {
  for (const double value : {0.0, std::numeric_limits<double>::denorm_min()}) {
    const Distribution1D distribution({value, value, value, value});
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(distribution.probability(i), 0.25);
      EXPECT_EQ(distribution.sample(0.25 * i + 0.1).cell, i);
    }
  }
}

TEST(Distribution2D, HasTheProbabilitiesOfItsValues) {
  constexpr int width = 9, height = 6;
  std::vector<double> values(width * height);
  double sum = 0;
  for (int i = 0; i < width * height; ++i) {
    values[i] = i / width == 2 || i % 5 == 0 ? 0 : random_uniform(2, i, 0);
    sum += values[i];
  }
  const Distribution2D distribution(values, width, height);
  EXPECT_NEAR(distribution.sum(), sum, 1e-14 * sum);
  std::vector<int> counts(width * height), within(16 * 16);
  for (int i = 0; i < 200000; ++i) {
    const Distribution2D::Sample sample = distribution.sample({random_uniform(3, i, 0), random_uniform(3, i, 1)});
    const int cell = sample.cell.y() * width + sample.cell.x();
    ++counts[cell];
    ++within[static_cast<int>(sample.within.y() * 16) * 16 + static_cast<int>(sample.within.x() * 16)];
    ASSERT_NEAR(sample.probability, values[cell] / sum, 1e-15);
    ASSERT_EQ(sample.probability, distribution.probability(sample.cell));
  }
  EXPECT_LT(std::abs(chi_square_score(counts, values)), 4);
  EXPECT_LT(std::abs(chi_square_score(within)), 4);
}

}  // namespace
}  // namespace tensorray
