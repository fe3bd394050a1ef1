#pragma once
/// Draws lines, grids and areas of one colour over pictures, anti-aliased.

#include <algorithm>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "renderer/images/image.h"

namespace tensorray {

/// The part of a pixel that a line covers, measured along a strip one pixel wide across the line. It is exact for lines
/// along x or y; for other directions the width of the line is correct on average.
/// @param distance  From the pixel's centre to the middle of the line, in pixels. @param width  In pixels.
double line_coverage(double distance, double width);

/// Mixes a colour into the first three channels of a pixel, and opacity into "A"; `coverage` is the weight, 0 to 1.
void lay_over(Image& image, int x, int y, const Eigen::Vector3d& color, double coverage);

// Positions and boxes are continuous, in pixels from the upper left corner. Parts outside the picture are cut off.

/// The pixels of a picture that a box covers, also partly; corners included. Empty if there are none.
Eigen::AlignedBox2i pixels_within(const Image& image, const Eigen::AlignedBox2d& box);

/// Calls `visit(x, y, coverage)` for each of these pixels.
template <class Visit>
void for_each_pixel(const Image& image, const Eigen::AlignedBox2d& box, const Visit& visit) {
  const auto overlap = [](double low, double high, int at) {
    return std::max(0.0, std::min(high, at + 1.0) - std::max(low, static_cast<double>(at)));
  };
  const Eigen::AlignedBox2i pixels = pixels_within(image, box);
  for (int y = pixels.min().y(); y <= pixels.max().y(); ++y)
    for (int x = pixels.min().x(); x <= pixels.max().x(); ++x)
      visit(x, y, overlap(box.min().x(), box.max().x(), x) * overlap(box.min().y(), box.max().y(), y));
}

void fill_box(Image& image, const Eigen::AlignedBox2d& box, const Eigen::Vector3d& color, double opacity = 1);

/// Draws a line with round ends; a dot if these are one point. @param width  In pixels.
void draw_stroke(Image& image, const Eigen::Vector2d& from, const Eigen::Vector2d& to, double width,
                 const Eigen::Vector3d& color);

/// Whether the picture is rather light than dark within a box: whether black ink is seen better there than white ink.
/// The picture may be scene-linear or display-referred; 1 is taken as white.
bool is_light(const Image& image, const Eigen::AlignedBox2d& box);

/// The texture coordinates that are seen at a pixel's centre, and their derivatives.
struct PixelCoordinates {
  bool valid = false;                                   ///< Whether the pixel sees anything.
  Eigen::Vector2d st = Eigen::Vector2d::Zero();         ///< Within [0, 1]² inside the picture.
  Eigen::Matrix2d per_pixel = Eigen::Matrix2d::Zero();  ///< Columns: change of (s, t) per pixel along x and along y.
};

struct GridLines {
  Eigen::Vector2i cells{16, 16};   ///< Lines lie at multiples of 1/cells, from 0 to 1; at least 1.
  double width = 1.5;              ///< Width of the lines on the picture, in pixels, at any distortion; ≥ 0.
  Eigen::Vector3d color{1, 1, 1};  ///< R, G, B, scene-linear.
  double opacity = 1;              ///< From 0 to 1.
};

/// Draws lines of constant s and t over the channels R, G, B of a picture. If there is a channel A, it becomes opaque
/// under the lines. Lines are anti-aliased, have the same width everywhere, and fade out where they would be closer
/// than three pixels. Pixels that are not valid, or whose coordinates are not finite, do not change. Where the picture
/// is magnified a thousand times or more, no lines are drawn either. Runs on all threads.
/// @param coordinates  One entry per pixel, row by row.
/// @throw std::invalid_argument if sizes or settings do not fit, or `image` does not begin with R, G, B.
void draw_grid_lines(Image& image, const std::vector<PixelCoordinates>& coordinates, const GridLines& lines);

}  // namespace tensorray
