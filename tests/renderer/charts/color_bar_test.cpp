#include "renderer/charts/color_bar.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tensorray {
namespace {

using ::testing::ElementsAre;

std::vector<std::string> labels(const ValueRange& range, int most = 7) {
  std::vector<std::string> texts;
  for (const Tick& tick : round_ticks(range, most)) texts.push_back(tick.label);
  return texts;
}

TEST(RoundTicksTest, LinearScales) {
  EXPECT_THAT(labels({0, 3.7}), ElementsAre("0", "1", "2", "3"));
  EXPECT_THAT(labels({0, 1}), ElementsAre("0", "0.2", "0.4", "0.6", "0.8", "1.0"));
  EXPECT_THAT(labels({-0.012, 0.03}), ElementsAre("-0.01", "0", "0.01", "0.02", "0.03"));
  EXPECT_THAT(labels({1000, 1002}, 3), ElementsAre("1000", "1001", "1002"));
  EXPECT_THAT(labels({-2.4e-6, 2.4e-6}), ElementsAre("-2e-6", "-1e-6", "0", "1e-6", "2e-6"));
  EXPECT_THAT(labels({0, 3e7}), ElementsAre("0", "0.5e7", "1.0e7", "1.5e7", "2.0e7", "2.5e7", "3.0e7"));
}

TEST(RoundTicksTest, LogarithmicScales) {
  EXPECT_THAT(labels({2e-4, 0.7, true}), ElementsAre("0.001", "0.01", "0.1"));
  EXPECT_THAT(labels({1, 1000, true}), ElementsAre("1", "10", "100", "1000"));
  EXPECT_THAT(labels({3, 30, true}), ElementsAre("5", "10", "20"));
  EXPECT_THAT(labels({3, 4, true}, 4), ElementsAre("3.0", "3.5", "4.0"));
  EXPECT_THAT(labels({1e-9, 1e6, true}), ElementsAre("1e-9", "1e-6", "0.001", "1", "1000", "1e6"));
}

Image plain(int width, int height, float value) {
  Image image(width, height, {"R", "G", "B"});
  std::fill(image.pixels.begin(), image.pixels.end(), value);
  return image;
}

/// A colour bar whose green increases with the position. Its red and blue are constant and appear nowhere else.
ColorBar green_bar() {
  return {"|T V|", {0, 4}, [](double x) { return Eigen::Vector3d(0.25, x, 0.125); }};
}

std::vector<Eigen::Vector2i> pixels_of_bar(const Image& image) {
  std::vector<Eigen::Vector2i> found;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (image.pixel(x, y)[0] == 0.25f && image.pixel(x, y)[2] == 0.125f) found.emplace_back(x, y);
  return found;
}

TEST(ColorBarTest, ShowsAllPositionsFromTheBottomToTheTop) {
  for (const int size : {200, 400, 801}) {
    Image image = plain(size * 3 / 2, size, 0);
    draw_color_bar(image, green_bar());
    const std::vector<Eigen::Vector2i> pixels = pixels_of_bar(image);
    ASSERT_FALSE(pixels.empty());
    const int top = pixels.front().y(), bottom = pixels.back().y();
    EXPECT_NEAR(bottom - top + 1, 0.6 * size, 1);
    EXPECT_NEAR(top + bottom, size, 0.1 * size);  // The bar is vertically centred.
    EXPECT_GT(pixels.front().x(), image.width * 0.75);
    for (const Eigen::Vector2i& p : pixels)
      EXPECT_NEAR(image.pixel(p.x(), p.y())[1], (bottom + 0.5 - p.y()) / (bottom - top + 1), 1e-6);
  }
}

/// The lines of the ticks are white, at the heights of 0, 1, ... 4, to the right of the frame of the bar.
TEST(ColorBarTest, TicksAreAtTheirValues) {
  Image image = plain(1000, 1000, 0);
  draw_color_bar(image, green_bar());
  const std::vector<Eigen::Vector2i> pixels = pixels_of_bar(image);
  const double top = pixels.front().y(), bottom = pixels.back().y() + 1.0;
  const int x = pixels.back().x() + 6;
  std::vector<double> middles;
  for (int y = 0, first = -1; y < image.height; ++y) {
    const bool is_ink = image.pixel(x, y)[0] > 0.9f;
    if (is_ink && first < 0) first = y;
    if (!is_ink && first >= 0) {
      if (first > top - 5) middles.push_back((first + y) / 2.0);
      first = -1;
    }
  }
  ASSERT_EQ(middles.size(), 5u);
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(middles[i], top + (bottom - top) * i / 4, 1);
}

TEST(ColorBarTest, IsCutOffWhereThePictureIsSmall) {
  for (const int size : {1, 7, 40}) {
    Image image = plain(size, size, 0.5f);
    draw_color_bar(image, green_bar());
    draw_color_key(image, direction_key());
    for (const float value : image.pixels) EXPECT_TRUE(value >= 0 && value <= 1);
  }
}

TEST(ColorKeyTest, ShowsEachColorOnceFromTheTop) {
  Image image = plain(400, 400, 0);
  draw_color_key(image, direction_key());
  std::vector<int> rows[3];
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 400; ++x)
      for (int c = 0; c < 3; ++c) {
        const float* const p = image.pixel(x, y);
        if (p[c] == 1 && p[(c + 1) % 3] == 0 && p[(c + 2) % 3] == 0) rows[c].push_back(y);
      }
  EXPECT_GT(rows[0].size(), 100u);
  EXPECT_EQ(rows[0].size(), rows[1].size());
  EXPECT_EQ(rows[0].size(), rows[2].size());
  EXPECT_LT(rows[0].back(), rows[1].front());
  EXPECT_LT(rows[1].back(), rows[2].front());
}

}  // namespace
}  // namespace tensorray
