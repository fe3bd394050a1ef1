#pragma once
/// @file renderer/images/grid_lines.h
/// Grid lines over a picture, straight or as a lens bends them.

#include <vector>

#include <Eigen/Core>

#include "renderer/images/image.h"

namespace tensorray {

/// The coordinates that a pixel's centre sees, and how they change.
struct PixelCoordinates {
  bool valid = false;                                   ///< Whether the pixel sees anything.
  Eigen::Vector2d st = Eigen::Vector2d::Zero();         ///< In [0, 1]² within the picture.
  Eigen::Matrix2d per_pixel = Eigen::Matrix2d::Zero();  ///< Columns: change of (s, t) per pixel along x, y.
};

struct GridLines {
  Eigen::Vector2i cells{16, 16};   ///< Lines lie at multiples of 1/cells, from 0 to 1; at least 1.
  double width = 1.5;              ///< Pixels, on the picture, however strongly it is distorted; ≥ 0.
  Eigen::Vector3d color{1, 1, 1};  ///< R, G, B, scene-linear.
  double opacity = 1;              ///< From 0 to 1.
};

/// Draws lines of constant s and t over the channels R, G, B of a picture (alpha, if there is an A, becomes opaque
/// where the line is). Lines are anti-aliased, have the same width everywhere, and fade to nothing where they would be
/// denser than three pixels. Pixels that are not valid, or whose coordinates are not finite, are left alone, and so is
/// what sees next to a single point (magnified a thousand times and more): it has no lines, or would be one all over.
/// Runs on all threads.
/// @param coordinates  One for each pixel, row by row.
/// @throw std::invalid_argument if sizes do not match, `image` does not begin with R, G, B, or a setting is out of
/// range.
void draw_grid_lines(Image& image, const std::vector<PixelCoordinates>& coordinates, const GridLines& lines);

}  // namespace tensorray
