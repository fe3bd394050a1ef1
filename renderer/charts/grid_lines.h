#pragma once
/// @file renderer/charts/grid_lines.h
/// Draws grid lines over a picture, straight or bent by a lens.

#include <vector>

#include <Eigen/Core>

#include "renderer/images/image.h"

namespace tensorray {

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
/// is magnified a thousand times or more, no lines are drawn either: a single line could cover the whole region. Runs
/// on all threads.
/// @param coordinates  One entry per pixel, row by row.
/// @throw std::invalid_argument if sizes do not match, `image` does not begin with R, G, B, or a setting is out of
/// range.
void draw_grid_lines(Image& image, const std::vector<PixelCoordinates>& coordinates, const GridLines& lines);

}  // namespace tensorray
