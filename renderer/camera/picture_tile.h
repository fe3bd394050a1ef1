#pragma once
/// @file renderer/camera/picture_tile.h
/// A part of a picture that the path tracer renders by itself: what it has so far, and its bytes.

#include <cstddef>
#include <vector>

#include "base/process/archive.h"
#include "renderer/camera/path_tracer.h"

namespace tensorray {

/// A square of the picture: a unit of the work.
struct Tile {
  /// @param light_values  Numbers of light for each pixel.
  Tile(int left, int top, int width, int height, std::size_t light_values);

  int left, top, width, height;  ///< In the picture.
  std::size_t light_values;
  std::vector<PixelState> pixels;  ///< Row by row.
  std::vector<double> light;       ///< Means of each pixel's bands; then of red, green and blue of each layer.
  bool is_done = false;            ///< Whether it gets no more samples.

  PixelState& pixel(int x, int y) { return pixels[static_cast<std::size_t>(y) * width + x]; }
  double* light_of(int x, int y) { return &light[(static_cast<std::size_t>(y) * width + x) * light_values]; }

  /// The samples of pixels that are not done.
  int samples() const;

  /// To bytes or from them. @throw DamagedArchive if there are not so many.
  void copy(Archive& archive);
};

/// A picture without samples, with the films that one of the scene has.
SurfacePicture empty_picture(int width, int height, bool transparent, const ShadedScene& scene);

void add_tile(const Tile& tile, SurfacePicture& picture);

}  // namespace tensorray
