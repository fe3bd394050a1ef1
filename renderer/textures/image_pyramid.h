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
/// Memory: 21 bytes for each pixel of a picture of up to 16 million pixels, of which all levels are stored. Of a larger
/// one, the picture as its file stores it, whose pixels are converted when they are read, and 5 bytes for each pixel,
/// which its other levels take. The constructor computes stored levels on all threads. Immutable; any number of threads
/// may read.
class ImagePyramid {
 public:
  /// @param conversion  From the colours of the picture to scene-linear colours.
  ImagePyramid(NativeImage image, ColorConversion conversion);

  int levels() const;
  int width(int level) const;
  int height(int level) const;
  Eigen::Vector4f mean() const;  ///< Mean of all pixels.

  /// A pixel of a level: R, G, B, A. x and y count from the upper left one.
  Eigen::Vector4f texel(int level, int x, int y) const;

 private:
  void read_picture(int x, int y, int count, float* rgba) const;
  void read_row(int level, int x, int y, int count, float* rgba) const;
  void reduce_row(int level, int y, float* rgba) const;

  NativeImage image_;
  ColorConversion conversion_;
  int first_stored_;
  std::vector<std::vector<float>> stored_;  ///< Levels from first_stored_ on.
};

}  // namespace tensorray
