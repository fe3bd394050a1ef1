#pragma once
/// @file renderer/textures/image_pyramid.h
/// A picture in scene-linear light at its full size and at smaller sizes (a MIP map).

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "renderer/color/color.h"
#include "renderer/images/image.h"

namespace tensorray {

/// Levels of R, G, B, A with the colours multiplied by alpha. Level 0 is the picture. Each further level has half the
/// width and height (rounded down, at least 1); the last level is a single pixel. A pixel of a level is the exact mean
/// over its area for any size of the picture, so that no level aliases and all levels have the same mean.
/// Memory: the picture as it is stored, and a third of a byte per pixel. Levels 0 to 2 are converted when they are
/// read; smaller levels are computed by the constructor, on all threads.
/// Immutable; any number of threads may read.
class ImagePyramid {
 public:
  /// @param conversion  From the colours of the picture to scene-linear colours.
  ImagePyramid(NativeImage image, ColorConversion conversion);

  int levels() const;
  int width(int level) const;
  int height(int level) const;
  Eigen::Vector4f mean() const;  ///< Mean of all pixels.

  /// Writes the pixels of a rectangle within a level, row by row from the top.
  /// @param row_pixels  Distance between the beginnings of consecutive rows in `rgba`, in pixels.
  void read(int level, int x, int y, int columns, int rows, std::size_t row_pixels, float* rgba) const;

 private:
  void read_row(int level, int x, int y, int count, float* rgba) const;
  void reduce_row(int from, int level, int x, int y, int count, float* rgba) const;

  NativeImage image_;
  ColorConversion conversion_;
  std::vector<std::vector<float>> stored_;  ///< Levels from 3 on.
};

}  // namespace tensorray
