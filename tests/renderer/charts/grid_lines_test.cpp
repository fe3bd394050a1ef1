#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "renderer/charts/ink.h"

namespace tensorray {
namespace {

const double no_landing = std::numeric_limits<double>::quiet_NaN();

using Coordinate = std::function<double(double x, double y)>;

/// Pixel coordinates from functions of the position; derivatives by central differences.
std::vector<PixelCoordinates> seen(int width, int height, const Coordinate& s, const Coordinate& t) {
  std::vector<PixelCoordinates> result;
  const double h = 1e-4;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const double x = column + 0.5, y = row + 0.5;
      PixelCoordinates pixel;
      pixel.valid = true;
      pixel.st = {s(x, y), t(x, y)};
      pixel.per_pixel.col(0) = Eigen::Vector2d(s(x + h, y) - s(x - h, y), t(x + h, y) - t(x - h, y)) / (2 * h);
      pixel.per_pixel.col(1) = Eigen::Vector2d(s(x, y + h) - s(x, y - h), t(x, y + h) - t(x, y - h)) / (2 * h);
      result.push_back(pixel);
    }
  return result;
}

/// A coordinate that has no lines.
double nothing(double, double) { return 0.5; }

std::vector<PixelCoordinates> undistorted(int width, int height) {
  return seen(
      width, height, [=](double x, double) { return x / width; }, [=](double, double y) { return y / height; });
}

/// Draws white lines on black.
Image drawn(int width, int height, const std::vector<PixelCoordinates>& coordinates, const GridLines& lines) {
  Image image(width, height, {"R", "G", "B"});
  draw_grid_lines(image, coordinates, lines);
  return image;
}

GridLines white_lines(int cells, double width) {
  GridLines lines;
  lines.cells = {cells, cells};
  lines.width = width;
  return lines;
}

double white_pixels(const Image& image) { return std::accumulate(image.pixels.begin(), image.pixels.end(), 0.0) / 3; }

TEST(GridLinesTest, LinesLieAtMultiplesOfACell) {
  const Image image = drawn(160, 80, undistorted(160, 80), white_lines(16, 2));  // Cells of 10 by 5 pixels.
  GridLines sparse = white_lines(8, 2);
  sparse.cells = {16, 8};
  const Image square = drawn(160, 80, undistorted(160, 80), sparse);
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 160; ++x) {
      const bool on_line = x % 10 == 0 || x % 10 == 9 || y % 10 == 0 || y % 10 == 9;
      ASSERT_NEAR(*square.pixel(x, y), on_line, 1e-6) << x << " " << y;
      const bool on_column = x % 10 == 0 || x % 10 == 9;
      ASSERT_TRUE(on_column || *image.pixel(x, y) < 1) << "denser lines must have begun to fade";
    }
}

/// Lines at any angle and magnification cover width × length. This holds not exactly in each pixel, but on average over
/// lines that cross pixels at many offsets (so the spacing is irrational).
TEST(GridLinesTest, WidthDoesNotDependOnAngleOrMagnification) {
  const int size = 512;
  for (const double angle : {0.0, 0.2, 0.7853981633974483, 1.1, 2.5})
    for (const double spacing : {7.0 + 1 / 3.7, 20 + 1 / 7.3}) {
      const int cells = 1000;
      const Coordinate s = [=](double x, double y) {
        return 0.5 + ((x - 256.1) * std::cos(angle) + (y - 256.2) * std::sin(angle)) / (spacing * cells);
      };
      const Image image = drawn(size, size, seen(size, size, s, nothing), white_lines(cells, 1.5));
      // One line more or less at the border covers 1.5 size of size² pixels.
      EXPECT_NEAR(white_pixels(image) / (size * size), 1.5 / spacing, 1.5 / size) << angle << " " << spacing;
    }
}

/// On a fold s is stationary: a line there may be up to twice as wide, and a line just beyond the fold adds nothing.
TEST(GridLinesTest, FoldsAreNotFlooded) {
  const int width = 401, height = 5;
  for (const double turning : {0.5, 0.5 - 1e-6, 0.5 - 1e-5, 0.5 - 1e-4}) {
    const Coordinate s = [=](double x, double) { return turning - 2e-6 * (x - 200.5) * (x - 200.5); };
    const Image image = drawn(width, height, seen(width, height, s, nothing), white_lines(2, 2));
    EXPECT_LE(white_pixels(image) / height, 2 * 2 + 0.5) << turning;
  }
}

TEST(GridLinesTest, NoLinesBeyondThePicture) {
  const Coordinate s = [](double x, double) { return (x - 50) / 100; };  // From -0.5 to 1.5.
  const Image image = drawn(200, 1, seen(200, 1, s, nothing), white_lines(4, 2));
  for (int x = 0; x < 200; ++x) {
    const bool on_line = x >= 49 && x <= 150 && (x % 25 == 0 || x % 25 == 24);
    ASSERT_NEAR(*image.pixel(x, 0), on_line, 1e-6) << x;
  }
}

TEST(GridLinesTest, LeavesAloneWhatIsNotValidOrNotFinite) {
  std::vector<PixelCoordinates> coordinates = undistorted(8, 1);
  coordinates[1].valid = false;
  coordinates[2].st.x() = no_landing;
  coordinates[3].per_pixel(0, 0) = no_landing;
  coordinates[4].per_pixel(1, 1) = std::numeric_limits<double>::infinity();
  coordinates[5].st.setConstant(1e300);
  coordinates[6].per_pixel.setConstant(1e300);
  const Image image = drawn(8, 1, coordinates, white_lines(1, 100));  // Lines so wide that they cover everything.
  for (int x = 0; x < 8; ++x) EXPECT_EQ(*image.pixel(x, 0), x == 0 || x == 7) << x;
}

TEST(GridLinesTest, BlendsByOpacityAndMakesOpaque) {
  Image image(6, 6, {"R", "G", "B", "Z", "A"});
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = i % 5 == 3 ? 9.0f : 0.5f;
  GridLines lines = white_lines(1, 100);
  lines.color = {4, 0.5, 0};
  lines.opacity = 0.25;
  draw_grid_lines(image, undistorted(6, 6), lines);
  for (std::size_t i = 0; i < image.pixels.size(); i += 5)
    EXPECT_EQ(std::vector<float>(&image.pixels[i], &image.pixels[i] + 5),
              (std::vector<float>{1.375f, 0.5f, 0.375f, 9, 0.625f}));
}

}  // namespace
}  // namespace tensorray
