#include "renderer/charts/ink.h"

#include <vector>

#include <gtest/gtest.h>

namespace tensorray {
namespace {

TEST(InkTest, CoverageIsTheSharedPartOfPixelAndLine) {
  EXPECT_DOUBLE_EQ(line_coverage(0, 3), 1);
  EXPECT_DOUBLE_EQ(line_coverage(0.3, 0.4), 0.4);
  EXPECT_DOUBLE_EQ(line_coverage(0.6, 0.4), 0.1);
  EXPECT_DOUBLE_EQ(line_coverage(1, 1.5), 0.25);
  EXPECT_DOUBLE_EQ(line_coverage(-1, 1.5), 0.25);
  EXPECT_DOUBLE_EQ(line_coverage(1.25, 1.5), 0);
  EXPECT_DOUBLE_EQ(line_coverage(100, 1.5), 0);
  EXPECT_DOUBLE_EQ(line_coverage(0, 0), 0);
  for (const double width : {0.2, 1.0, 1.5, 4.7})
    for (const double phase : {0.0, 0.25, 0.41, 0.9}) {
      double sum = 0;
      for (int x = -10; x <= 10; ++x) sum += line_coverage(x + phase, width);
      EXPECT_NEAR(sum, width, 1e-12);
    }
}

TEST(InkTest, LayingOverBlendsThreeChannelsAndAlpha) {
  Image image(2, 1, {"Y", "A"});
  lay_over(image, 1, 0, {0.5, 0.7, 0.9}, 0.5);
  EXPECT_EQ(image.pixels, (std::vector<float>{0, 0, 0.25f, 0.5f}));
  Image many(1, 1, {"R", "G", "B", "Z"});
  lay_over(many, 0, 0, {1, 2, 4}, 0.25);
  EXPECT_EQ(many.pixels, (std::vector<float>{0.25f, 0.5f, 1, 0}));
}

}  // namespace
}  // namespace tensorray
