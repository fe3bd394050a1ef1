#include "renderer/charts/lettering.h"

#include <cctype>
#include <functional>
#include <map>
#include <numeric>

#include "base/constants.h"
#include "renderer/charts/ink.h"
#include "tests/names.h"

namespace tensorray {
namespace {

const Vector3d white(1, 1, 1);

/// Draws white text on black, in one channel; `position` is its lower left corner.
Image drawn(const std::string& text, double height, const Vector2d& position, int columns, int rows) {
  Image image(columns, rows, {"Y"});
  draw_text(image, position, height, text, white);
  return image;
}

/// Draws text with a margin on all sides.
Image drawn(const std::string& text, double height) {
  const int size = static_cast<int>(2 * height);
  return drawn(text, height, {height / 2, 1.5 * height}, size + static_cast<int>(text_width(text, height)), size);
}

double ink(const Image& image) { return std::accumulate(image.pixels.begin(), image.pixels.end(), 0.0); }

double largest_outside(const Image& image, double left, double right, double top, double bottom) {
  double largest = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (x + 1 <= left || x >= right || y + 1 <= top || y >= bottom)
        largest = std::max<double>(largest, *image.pixel(x, y));
  return largest;
}

TEST(LetteringTest, EveryPrintableCharacterIsDrawnAndDiffersFromAllOthers) {
  std::map<std::vector<float>, char> seen;
  for (char c = ' '; c <= '~'; ++c) {
    const Image image = drawn(std::string(1, c), 32, {16, 48}, 80, 64);
    EXPECT_EQ(ink(image) > 0, c != ' ') << c;
    const auto [other, is_new] = seen.emplace(image.pixels, c);
    EXPECT_TRUE(is_new) << c << " looks like " << other->second;
  }
  EXPECT_TRUE(seen.emplace(drawn("\n", 32, {16, 48}, 80, 64).pixels, '\n').second) << "the box looks like a character";
}

/// The ink is as wide as text_width says. It stays between the base line and the height of a capital, or a quarter of
/// that height below the base line if a character has a descender. (The digit 1 is narrower than its width.)
TEST(LetteringTest, InkIsWithinTheLine) {
  for (char c = '!'; c <= '~'; ++c)
    for (const double height : {10.0, 33.7, 64.0}) {
      const std::string text(1, c);
      const double left = 20.25, right = left + text_width(text, height), bottom = 70.5, top = bottom - height;
      const bool descends = std::string("gjpqy(),;@[]_{}|").find(c) != std::string::npos;
      const Image image = drawn(text, height, {left, bottom}, 120, 100);
      EXPECT_LT(largest_outside(image, left, right, top, bottom + (descends ? height / 4 : 0)), 1e-6) << c;
      EXPECT_TRUE(c == '1' || largest_outside(image, left + 1.5, right, 0, 100) > 0)
          << c << " does not reach its left edge";
      EXPECT_TRUE(c == '1' || largest_outside(image, left, right - 1.5, 0, 100) > 0)
          << c << " does not reach its right edge";
      if (std::isupper(static_cast<unsigned char>(c)) || std::isdigit(static_cast<unsigned char>(c))) {
        EXPECT_GT(largest_outside(image, left, right, top + 1.5, 100), 0) << c << " is no capital";
        EXPECT_GT(largest_outside(image, left, right, 0, bottom - 1.5), 0) << c << " does not stand on the line";
      }
    }
}

TEST(LetteringTest, TextIsItsCharactersSideBySide) {
  const std::string text = "Ag 1e-3";
  const double height = 24.5;
  Image apart(200, 40, {"Y"});
  for (std::size_t i = 0; i < text.size(); ++i) {
    const double x = 5 + text_width(text.substr(0, i + 1), height) - text_width(text.substr(i, 1), height);
    draw_text(apart, {x, 30}, height, text.substr(i, 1), white);
  }
  const Image together = drawn(text, height, {5, 30}, 200, 40);
  for (std::size_t i = 0; i < apart.pixels.size(); ++i) ASSERT_NEAR(apart.pixels[i], together.pixels[i], 1e-5);
}

/// A stroke of width w and length l with round ends covers w l + π w² / 4; a closed one covers w l. A capital O has two
/// half circles with a radius of 10/32 of the height, and straight lines of 8/32; a stroke is 4/32 wide.
TEST(LetteringTest, StrokesCoverTheirArea) {
  const double height = 160, unit = height / 32, end_caps = pi * 4 * unit * unit;
  EXPECT_NEAR(ink(drawn(".", height)), end_caps, 0.01 * end_caps);
  EXPECT_NEAR(ink(drawn("I", height)), 4 * 28 * unit * unit + end_caps, 0.003 * 4 * 28 * unit * unit);
  const double ring = 4 * (2 * pi * 10 + 2 * 8) * unit * unit;
  EXPECT_NEAR(ink(drawn("O", height)), ring, 0.003 * ring);
}

TEST(LetteringTest, WhatLiesOutsideIsCutOff) {
  const Image whole = drawn("Query @", 30, {40, 60}, 240, 100);
  const int left = 55, top = 42, width = 90, height = 20;
  const Image part = drawn("Query @", 30, {40 - left, 60 - top}, width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) ASSERT_NEAR(*part.pixel(x, y), *whole.pixel(x + left, y + top), 1e-5);
  EXPECT_EQ(ink(drawn("far", 10, {1e300, -1e300}, 5, 5)), 0);
  EXPECT_EQ(ink(drawn("far", 10, {-1000, 3}, 5, 5)), 0);
  EXPECT_EQ(ink(drawn("I", 1e9, {-0.05e9, 0.5e9}, 1, 1)), 1);  // The pixel is well inside the stroke.
  EXPECT_GT(ink(drawn("I", 1e-3, {0.5, 0.5}, 1, 1)), 0);
}

TEST(LetteringTest, OtherCharactersAreBoxes) {
  const std::vector<float> box = drawn("\t", 20, {5, 25}, 80, 40).pixels;
  for (const char* text : {"\n", "\x7f", "\xC3\xA9", "\xE2\x82\xAC", "\xF0\x9F\x98\x80"}) {
    EXPECT_EQ(drawn(text, 20, {5, 25}, 80, 40).pixels, box) << text;
    EXPECT_EQ(text_width(text, 20), text_width("\t", 20)) << text;
  }
  EXPECT_EQ(drawn("caf\xC3\xA9s", 20, {5, 25}, 120, 40).pixels, drawn("caf\ts", 20, {5, 25}, 120, 40).pixels);
}

using Coordinate = std::function<double(double x, double y)>;

double without_lines(double, double) { return 0.5; }

/// Pixel coordinates from functions of the position; derivatives by central differences.
std::vector<PixelCoordinates> seen(int width, int height, const Coordinate& s, const Coordinate& t = without_lines) {
  std::vector<PixelCoordinates> result;
  const double h = 1e-4;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const double x = column + 0.5, y = row + 0.5;
      PixelCoordinates pixel;
      pixel.valid = true;
      pixel.st = {s(x, y), t(x, y)};
      pixel.per_pixel.col(0) = Vector2d(s(x + h, y) - s(x - h, y), t(x + h, y) - t(x - h, y)) / (2 * h);
      pixel.per_pixel.col(1) = Vector2d(s(x, y + h) - s(x, y - h), t(x, y + h) - t(x, y - h)) / (2 * h);
      result.push_back(pixel);
    }
  return result;
}

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

TEST(GridLinesTest, LinesLieAtMultiplesOfACell) {
  const Image image = drawn(160, 80, undistorted(160, 80), {{16, 16}, 2});  // Cells of 10 by 5 pixels.
  const Image square = drawn(160, 80, undistorted(160, 80), {{16, 8}, 2});
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
      const Image image = drawn(size, size, seen(size, size, s), {{cells, cells}, 1.5});
      // One line more or less at the border covers 1.5 size of size² pixels.
      EXPECT_NEAR(ink(image) / 3 / (size * size), 1.5 / spacing, 1.5 / size) << angle << " " << spacing;
    }
}

/// On a fold s is stationary: a line there may be up to twice as wide, and a line just beyond the fold adds nothing.
TEST(GridLinesTest, FoldsAreNotFlooded) {
  const int width = 401, height = 5;
  for (const double turning : {0.5, 0.5 - 1e-6, 0.5 - 1e-5, 0.5 - 1e-4}) {
    const Coordinate s = [=](double x, double) { return turning - 2e-6 * (x - 200.5) * (x - 200.5); };
    const Image image = drawn(width, height, seen(width, height, s), {{2, 2}, 2});
    EXPECT_LE(ink(image) / 3 / height, 2 * 2 + 0.5) << turning;
  }
}

TEST(GridLinesTest, NoLinesBeyondThePicture) {
  const Coordinate s = [](double x, double) { return (x - 50) / 100; };  // From -0.5 to 1.5.
  const Image image = drawn(200, 1, seen(200, 1, s), {{4, 4}, 2});
  for (int x = 0; x < 200; ++x) {
    const bool on_line = x >= 49 && x <= 150 && (x % 25 == 0 || x % 25 == 24);
    ASSERT_NEAR(*image.pixel(x, 0), on_line, 1e-6) << x;
  }
}

TEST(GridLinesTest, LeavesAloneWhatIsNotValidOrNotFinite) {
  std::vector<PixelCoordinates> coordinates = undistorted(8, 1);
  coordinates[1].valid = false;
  coordinates[2].st.x() = NAN;
  coordinates[3].per_pixel(0, 0) = NAN;
  coordinates[4].per_pixel(1, 1) = INFINITY;
  coordinates[5].st.setConstant(1e300);
  coordinates[6].per_pixel.setConstant(1e300);
  const Image image = drawn(8, 1, coordinates, {{1, 1}, 100});  // Lines so wide that they cover everything.
  for (int x = 0; x < 8; ++x) EXPECT_EQ(*image.pixel(x, 0), x == 0 || x == 7) << x;
}

TEST(GridLinesTest, BlendsByOpacityAndMakesOpaque) {
  Image image(6, 6, {"R", "G", "B", "Z", "A"});
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = i % 5 == 3 ? 9.0f : 0.5f;
  draw_grid_lines(image, undistorted(6, 6), {{1, 1}, 100, {4, 0.5, 0}, 0.25});
  for (std::size_t i = 0; i < image.pixels.size(); i += 5)
    EXPECT_EQ(std::vector<float>(&image.pixels[i], &image.pixels[i] + 5),
              (std::vector<float>{1.375f, 0.5f, 0.375f, 9, 0.625f}));
}

}  // namespace
}  // namespace tensorray
