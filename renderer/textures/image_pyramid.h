#pragma once
/// @file renderer/textures/image_pyramid.h
/// A picture in scene-linear light, at its full size and at smaller ones (a MIP map).

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "renderer/color/color.h"
#include "renderer/images/image.h"

namespace tensorray {

/// Levels of R, G, B, A with the alpha multiplied in. Level 0 is the picture; every further one has half the width and
/// height (rounded down, at least 1), the last one is a single pixel. A pixel of a level is the exact mean over its
/// area, whatever the size, so that no level aliases and all of them have the same mean.
/// Memory: the picture as it is stored, and a third of a byte for each of its pixels. Levels 0 to 2 are converted when
/// they are read; the smaller ones are made at the beginning, on all threads.
/// Immutable; any number of threads may read.
class ImagePyramid {
 public:
  /// @param conversion  From the picture's colours to scene-linear ones.
  ImagePyramid(NativeImage image, ColorConversion conversion);

  int levels() const;
  int width(int level) const;
  int height(int level) const;
  Eigen::Vector4f mean() const;  ///< Of all pixels.

  /// Writes the pixels of a rectangle within a level, row by row from the top.
  /// @param row_pixels  From the beginning of a row in `rgba` to that of the next, in pixels.
  void read(int level, int x, int y, int columns, int rows, std::size_t row_pixels, float* rgba) const;

 private:
  void read_row(int level, int x, int y, int count, float* rgba) const;
  void reduce_row(int from, int level, int x, int y, int count, float* rgba) const;

  NativeImage image_;
  ColorConversion conversion_;
  std::vector<std::vector<float>> stored_;  ///< Levels from 3 on.
};

}  // namespace tensorray
