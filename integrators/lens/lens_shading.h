#pragma once
/// @file integrators/lens/lens_shading.h
/// The light of a pixel of a lens's picture.

#include <vector>

#include <Eigen/Core>

#include "integrators/lens/lens_view.h"

namespace tensorray {

/// Light of a pixel while its samples are added.
struct PixelLight {
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  std::vector<double> channels, alpha;  // By channel, and by band.
};

/// Shades the pixels of a tile.
class TileShader {
 public:
  TileShader(const LensView& view, int tile, TraceCounts& counts)
      : view_(view), tile_(tile), counts_(counts), whole_(view_tile(view, tile, 1, view.spans, counts)) {}

  /// Adds the light of a pixel to `light`. Where it is spread over several pixels of the image, one sample shows as
  /// much as many; where it is hardly spread, few nodes show as much as all.
  /// @param x,y  In the tile.
  void shade(int x, int y, PixelLight& light);

 private:
  const LensView& view_;
  const int tile_;
  TraceCounts& counts_;
  const TileView whole_;  // A sample for each pixel.
  TileView few_, all_;    // All samples, at few nodes and at all.
};

}  // namespace tensorray
