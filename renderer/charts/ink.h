#pragma once
/// @file renderer/charts/ink.h
/// Draws lines and areas of one colour over pictures, anti-aliased.

#include <algorithm>

#include <Eigen/Geometry>

#include "renderer/images/image.h"

namespace tensorray {

/// The part of a pixel that a line covers, measured along a strip one pixel wide across the line. It is exact for lines
/// along x or y; for other directions the width of the line is correct on average.
/// @param distance  From the pixel's centre to the middle of the line, in pixels. @param width  In pixels.
double line_coverage(double distance, double width);

/// Mixes a colour into the first three channels of a pixel; `coverage` is its weight, 0 to 1. A channel "A" becomes
/// opaque by the same weight.
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

}  // namespace tensorray
