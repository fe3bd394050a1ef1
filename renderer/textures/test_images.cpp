#include "renderer/textures/test_images.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/LU>
#include <tbb/parallel_for.h>

#include "base/constants.h"
#include "renderer/charts/ink.h"
#include "renderer/charts/lettering.h"

namespace tensorray {
namespace {

constexpr int cells_across = 16;  // Number of cells along the shorter side.

double cell_size(const Image& image) { return std::min(image.width, image.height) / static_cast<double>(cells_across); }

template <class Color>
void fill(Image& image, const Color& color) {
  tbb::parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector3d value = color(x, y);
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = static_cast<float>(value[c]);
    }
  });
}

/// Length of the part of [0, x] that lies in stripes [i period, i period + width); negative for negative x.
double covered_length(double x, double period, double width) {
  const double before = std::floor(x / period);
  return before * width + std::min(x - before * period, width);
}

/// The exact part of each of `size` pixels in a row that stripes cover, of which one begins at `start` from the middle.
std::vector<double> stripes(int size, double period, double width, double start) {
  std::vector<double> shares(size);
  for (int x = 0; x < size; ++x) {
    const double from = x - size / 2.0 - start;
    shares[x] = covered_length(from + 1, period, width) - covered_length(from, period, width);
  }
  return shares;
}

void draw_checkerboard(Image& image) {
  const double cell = cell_size(image);
  const std::vector<double> columns = stripes(image.width, 2 * cell, cell, 0);
  const std::vector<double> rows = stripes(image.height, 2 * cell, cell, 0);
  fill(image, [&](int x, int y) -> Eigen::Vector3d {
    return Eigen::Vector3d::Constant(columns[x] * rows[y] + (1 - columns[x]) * (1 - rows[y]));
  });
}

// The quadrants of the grid, row by row: background colours of nearly equal luminance, and the colour of the labels.
const std::array<Eigen::Vector3d, 4> tints{
    {{0.83, 0.91, 1.00}, {1.00, 0.90, 0.76}, {0.83, 0.94, 0.80}, {1.00, 0.86, 0.90}}};
const std::array<Eigen::Vector3d, 4> inks{
    {{0.02, 0.08, 0.25}, {0.22, 0.09, 0.01}, {0.02, 0.13, 0.03}, {0.24, 0.03, 0.09}}};
constexpr double legible = 5;  // In pixels; smaller labels are left out.

// Constants of the colour wheel.
constexpr double surround = 0.2;             // Grey value around the wheel.
constexpr double graduation_strength = 0.5;  // Opacity of the fine black lines.

/// The part of each pixel in a row that is covered by lines at multiples of the cell. Every fourth line is thicker.
std::vector<double> line_shares(int size, double cell) {
  const double thin = cell / 24, thick = cell / 12;
  std::vector<double> shares = stripes(size, cell, thin, -thin / 2);
  const std::vector<double> fourth = stripes(size, 4 * cell, thick, -thick / 2);
  const std::vector<double> both = stripes(size, 4 * cell, thin, -thin / 2);
  for (int x = 0; x < size; ++x) shares[x] += fourth[x] - both[x];
  return shares;
}

/// Returns A, B ... Z, AA, AB ...
std::string column_name(int column) {
  const std::string last(1, static_cast<char>('A' + column % 26));
  return column < 26 ? last : column_name(column / 26 - 1) + last;
}

/// Draws labels of equal height into the middle of all whole cells.
void draw_labels(Image& image, double cell) {
  const int columns = 2 * static_cast<int>(image.width / (2 * cell));
  const int rows = 2 * static_cast<int>(image.height / (2 * cell));
  const Eigen::Vector2d corner((image.width - columns * cell) / 2, (image.height - rows * cell) / 2);
  const std::string widest = std::string(column_name(columns - 1).size(), 'W') + std::to_string(rows);
  const double height = std::min(cell / 3, 0.75 * cell / text_width(widest, 1));
  if (height < legible) return;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const std::string label = column_name(column) + std::to_string(row + 1);
      const Eigen::Vector2d middle = corner + cell * Eigen::Vector2d(column + 0.5, row + 0.5);
      const Eigen::Vector2d half(text_width(label, height) / 2, -height / 2);
      draw_text(image, middle - half, height, label, inks[2 * (row >= rows / 2) + (column >= columns / 2)]);
    }
}

void draw_grid(Image& image) {
  const double cell = cell_size(image);
  const std::vector<double> columns = line_shares(image.width, cell), rows = line_shares(image.height, cell);
  fill(image, [&](int x, int y) -> Eigen::Vector3d {
    // Part of the pixel that lies in the right half.
    const double right = std::clamp(x + 1 - image.width / 2.0, 0.0, 1.0);
    const double lower = std::clamp(y + 1 - image.height / 2.0, 0.0, 1.0);
    const Eigen::Vector3d above = (1 - right) * tints[0] + right * tints[1];
    const Eigen::Vector3d below = (1 - right) * tints[2] + right * tints[3];
    return (1 - columns[x]) * (1 - rows[y]) * ((1 - lower) * above + lower * below);
  });
  draw_labels(image, cell);
}

// Colours are stored as the cube roots of cone responses; Oklab (Ottosson 2020) is linear in these. White is (1, 1, 1).
using Roots = Eigen::Array3d;

Eigen::Matrix3d to_cones() {
  Eigen::Matrix3d matrix;
  matrix << 0.4122214708, 0.5363325363, 0.0514459929,  //
      0.2119034982, 0.6806995451, 0.1073969566,        //
      0.0883024619, 0.2817188376, 0.6299787005;
  return matrix;
}

Roots roots_of(const Eigen::Vector3d& rgb) {
  const Eigen::Vector3d cones = to_cones() * rgb;
  return {std::cbrt(cones[0]), std::cbrt(cones[1]), std::cbrt(cones[2])};
}

double oklab_hue(const Roots& roots) {
  const double a = 1.9779984951 * roots[0] - 2.4285922050 * roots[1] + 0.4505937099 * roots[2];
  const double b = 0.0259040371 * roots[0] + 0.7827717662 * roots[1] - 0.8086757660 * roots[2];
  return std::atan2(b, a);
}

/// The most saturated colours. @param position  0 red, 1 yellow, 2 green, 3 cyan, 4 blue, 5 magenta, 6 red.
Roots saturated(double position) {
  Eigen::Vector3d rgb;
  for (int c = 0; c < 3; ++c) rgb[c] = std::clamp(2 - std::abs(std::remainder(position - 2 * c, 6)), 0.0, 1.0);
  return roots_of(rgb);
}

constexpr int hue_count = 720;

/// The most saturated colours, starting with red, at equal distances in hue.
std::vector<Roots> hue_circle() {
  std::vector<Roots> circle;
  const double red = oklab_hue(saturated(0));
  for (int i = 0; i < hue_count; ++i) {
    double low = 0, high = 6;
    for (int bit = 0; bit < 40; ++bit) {
      const double hue = oklab_hue(saturated((low + high) / 2)) - red;
      (hue - 2 * pi * std::floor(hue / (2 * pi)) < 2 * pi * i / hue_count ? low : high) = (low + high) / 2;
    }
    circle.push_back(saturated(low));
  }
  return circle;
}

/// Removes the creases at the primaries, which would look like lines drawn by a lens.
std::vector<Roots> smoothed(const std::vector<Roots>& circle) {
  const int reach = hue_count / 12;
  std::vector<Roots> result(hue_count, Roots::Zero());
  for (int i = 0; i < hue_count; ++i)
    for (int k = -reach; k <= reach; ++k) {
      const double weight = (1 + std::cos(pi * k / reach)) / (2 * reach);
      result[i] += weight * circle[(i + k + hue_count) % hue_count];
    }
  return result;
}

/// Returns linear Rec.709. @param angle  From red, in [0, 2π]. @param saturation  From 0 (white) to 1.
Eigen::Vector3d wheel_color(const std::vector<Roots>& circle, const Eigen::Matrix3d& from_cones, double angle,
                            double saturation) {
  const double position = angle / (2 * pi) * hue_count;
  const int i = static_cast<int>(position);
  const Roots &before = circle[i % hue_count], &after = circle[(i + 1) % hue_count];
  const Roots roots = 1 + saturation * (before + (position - i) * (after - before) - 1);
  return (from_cones * roots.cube().matrix()).cwiseMax(0).cwiseMin(1);
}

/// Coverage by the fine lines of the wheel. @param radius  Distance from the middle of the wheel, in pixels.
double graduation(double radius, double angle, double rim, double width) {
  const double ring = rim / 8, step = 2 * pi / 24;
  const double circle = line_coverage(radius - std::round(radius / ring) * ring, width);
  const double ray = line_coverage(radius * std::sin(angle - std::round(angle / step) * step), width);
  // Radial lines end at the innermost circle, so that they do not merge. The centre has no circle.
  return radius < ring / 2 ? 0 : radius < ring ? circle : std::max(circle, ray);
}

void draw_color_wheel(Image& image) {
  const double size = std::min(image.width, image.height), rim = 0.46 * size, width = size / 512;
  const std::vector<Roots> circle = smoothed(hue_circle());
  const Eigen::Matrix3d from_cones = to_cones().inverse();
  fill(image, [&](int x, int y) -> Eigen::Vector3d {
    const Eigen::Vector2d p(x + 0.5 - image.width / 2.0, image.height / 2.0 - y - 0.5);
    const double radius = p.norm();
    const double inside = std::clamp(rim - radius + 0.5, 0.0, 1.0);
    if (inside == 0) return Eigen::Vector3d::Constant(surround);
    const double angle = std::atan2(p.y(), p.x()) + (p.y() < 0 ? 2 * pi : 0);
    const Eigen::Vector3d color = wheel_color(circle, from_cones, angle, std::min(radius / rim, 1.0));
    const double ink = graduation_strength * graduation(radius, angle, rim, width);
    return inside * (1 - ink) * color + Eigen::Vector3d::Constant((1 - inside) * surround);
  });
}

void draw_line(Image& image) {
  fill(image, [&](int x, int) -> Eigen::Vector3d {
    return Eigen::Vector3d::Constant(line_coverage(x + 0.5 - image.width / 2.0, image.width / 64.0));
  });
}

}  // namespace

Image test_image(TestImage which, int width, int height) {
  if (width < 1 || height < 1) throw std::invalid_argument("a test picture must be at least one pixel wide and high");
  Image image(width, height, {"R", "G", "B"});
  constexpr std::array<void (*)(Image&), 4> draw{draw_checkerboard, draw_grid, draw_color_wheel, draw_line};
  draw[static_cast<std::size_t>(which)](image);
  return image;
}

}  // namespace tensorray
