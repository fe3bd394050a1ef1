#include "renderer/textures/test_images.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "base/constants.h"

namespace tensorray {
namespace {

using Channels = std::vector<std::string>;

double mean(const Image& image) {
  return std::accumulate(image.pixels.begin(), image.pixels.end(), 0.0) / static_cast<double>(image.pixels.size());
}

/// A smaller picture, each pixel of which is the mean of `factor` × `factor` pixels.
Image reduced(const Image& image, int factor) {
  Image result(image.width / factor, image.height / factor, image.channels);
  for (int y = 0; y < result.height * factor; ++y)
    for (int x = 0; x < result.width * factor; ++x)
      for (int c = 0; c < 3; ++c)
        result.pixel(x / factor, y / factor)[c] += image.pixel(x, y)[c] / static_cast<float>(factor * factor);
  return result;
}

double largest_difference(const Image& a, const Image& b) {
  EXPECT_EQ(a.pixels.size(), b.pixels.size());
  double largest = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    largest = std::max<double>(largest, std::abs(a.pixels[i] - b.pixels[i]));
  return largest;
}

/// Edges are anti-aliased exactly: a small picture equals a large one after reduction. (The grids are so small that
/// neither has labels.)
TEST(TestImagesTest, SmallPicturesAreLargeOnesReduced) {
  for (const TestImage which : {TestImage::checkerboard, TestImage::grid, TestImage::line})
    for (const auto& [width, height] : {std::pair(1, 1), {5, 3}, {31, 47}, {32, 32}, {50, 41}})
      EXPECT_LT(
          largest_difference(test_image(which, width, height), reduced(test_image(which, 4 * width, 4 * height), 4)),
          1e-5)
          << static_cast<int>(which) << ": " << width << " x " << height;
}

TEST(TestImagesTest, CheckerboardIsBlackAndWhiteInEqualParts) {
  const Image image = test_image(TestImage::checkerboard, 96, 64);  // Cells of 4 pixels.
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 96; ++x)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(image.pixel(x, y)[c], (x / 4 + y / 4) % 2 == 0 ? 1 : 0);
  EXPECT_EQ(mean(image), 0.5);
  EXPECT_NEAR(mean(test_image(TestImage::checkerboard, 101, 101)), 0.5, 1e-6);
  EXPECT_NEAR(mean(test_image(TestImage::checkerboard, 1, 1)), 0.5, 1e-6);
}

TEST(TestImagesTest, LineIsASixtyFourthOfTheWidthInTheMiddle) {
  for (const int width : {1, 7, 64, 100, 128, 1001}) {
    const Image image = test_image(TestImage::line, width, 3);
    EXPECT_NEAR(mean(image), 1 / 64.0, 1e-8) << width;
    for (int x = 0; x < width; ++x) {
      ASSERT_NEAR(*image.pixel(x, 0), *image.pixel(width - 1 - x, 0), 1e-6);
      if (std::abs(x + 0.5 - width / 2.0) > width / 128.0 + 0.5) {
        ASSERT_EQ(*image.pixel(x, 1), 0);
      }
    }
  }
  const Image image = test_image(TestImage::line, 128, 2);
  for (int x = 0; x < 128; ++x) EXPECT_EQ(*image.pixel(x, 1), x == 63 || x == 64 ? 1 : 0) << x;
}

/// The pixels of a cell of the grid without its lines, for comparison.
std::vector<float> cell_of(const Image& image, int left, int top, int cell) {
  std::vector<float> pixels;
  for (int y = top + cell / 8; y < top + cell - cell / 8; ++y)
    for (int x = left + cell / 8; x < left + cell - cell / 8; ++x)
      pixels.insert(pixels.end(), image.pixel(x, y), image.pixel(x, y) + 3);
  return pixels;
}

TEST(TestImagesTest, GridHasALabelOfItsOwnInEveryWholeCell) {
  const int cell = 32, columns = 40, rows = 16;  // With 40 columns, labels continue after Z.
  const Image image = test_image(TestImage::grid, columns * cell + 30, rows * cell);
  std::set<std::vector<float>> labels;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const std::vector<float> pixels = cell_of(image, 15 + column * cell, row * cell, cell);
      EXPECT_LT(*std::min_element(pixels.begin(), pixels.end()), 0.3) << "no label in column " << column;
      labels.insert(pixels);
    }
  EXPECT_EQ(labels.size(), static_cast<std::size_t>(columns * rows));
}

/// Centre and size of the wheel in a square picture: it fills 92 %.
struct Wheel {
  Image image = test_image(TestImage::color_wheel, 1024, 1024);

  /// @param radius  Relative to the radius of the wheel.
  Eigen::Vector3d at(double radius, double angle) const {
    const double r = 0.46 * 1024 * radius;
    const float* pixel =
        image.pixel(static_cast<int>(512 + r * std::cos(angle)), static_cast<int>(512 - r * std::sin(angle)));
    return {pixel[0], pixel[1], pixel[2]};
  }
};

TEST(TestImagesTest, ColorWheelHasRedAtTheRightAndGoesOnCounterClockwise) {
  const Wheel wheel;
  const double shift = 0.06;  // Away from the radial lines.
  const auto largest = [&](double angle) {
    Eigen::Index channel = 0;
    wheel.at(0.94, angle + shift).maxCoeff(&channel);
    return channel;
  };
  EXPECT_EQ(largest(0), 0);
  EXPECT_EQ(largest(2 * pi / 3), 1);
  EXPECT_EQ(largest(4 * pi / 3), 2);
  const Eigen::Vector3d yellow = wheel.at(0.94, 1.4 + shift);
  EXPECT_LT(yellow[2], 0.3 * std::min(yellow[0], yellow[1]));
}

}  // namespace
}  // namespace tensorray
