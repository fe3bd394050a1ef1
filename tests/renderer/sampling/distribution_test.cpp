#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "renderer/sampling/random.h"
#include "renderer/sampling/sampling.h"
#include "tests/renderer/statistics.h"

namespace tensorray {
namespace {

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

}  // namespace
}  // namespace tensorray
