#pragma once
/// @file renderer/camera/picture_tile.h
/// A part of a picture that the path tracer renders by itself: what it has so far, and its bytes.

#include <cstddef>
#include <limits>
#include <type_traits>
#include <vector>

#include "base/process/archive.h"
#include "renderer/camera/path_tracer.h"

namespace tensorray {

/// What a pixel has so far, without its bands. It has no pointers and no gaps: files keep its bytes.
struct PixelState {
  int samples = 0, hits = 0, force_hits = 0, length_hits = 0, texture_hits = 0, folds_hits = 0, bent = 0, done = 0;
  double luminance = 0, squares = 0;  ///< Mean, and the sum of squared differences from it (Welford 1962).
  double nearest = std::numeric_limits<double>::infinity();  ///< Squared distance from the centre to the path hit.
  // As in SurfacePicture:
  float depth = 0, force = 0, arc_length = 0, folds = 0, radiance_scale = 1, deflection = 0, arrives = 1, path = -1;
  float normal[3] = {0, 0, 0}, albedo[3] = {0, 0, 0}, texture[2] = {0, 0};

  /// Squared standard error of the luminance.
  float variance() const {
    const double count = samples;
    return samples > 1 ? static_cast<float>(squares / (count * (count - 1))) : 0.0f;
  }
};
static_assert(sizeof(PixelState) == 120 && std::is_trivially_copyable_v<PixelState>);

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

/// A picture without samples, with the planes that one of the scene has.
SurfacePicture empty_picture(int width, int height, const ShadedScene& scene);

void add_tile(const Tile& tile, bool transparent, SurfacePicture& picture);

}  // namespace tensorray
