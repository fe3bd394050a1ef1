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

/// Shades the pixels of a tile. Light that hardly moves from band to band is looked at for several bands together.
/// Where light of a band sees two sheets of the image, or the image and nothing, the band is looked at in parts.
class TileShader {
 public:
  TileShader(const LensView& view, int tile, TraceCounts& counts);

  /// Adds the light of a pixel to `light`. Where it is spread over several pixels of the image, one sample shows as
  /// much as many.
  /// @param x,y  In the tile.
  void shade(int x, int y, PixelLight& light);

 private:
  void find_sweeps();
  bool is_bent(std::size_t pixel) const;
  bool moves_smoothly() const;
  void interpolate();
  TileView view_samples(const std::vector<Span>& spans, bool still);
  void view_torn_bands();

  const LensView& view_;
  const int tile_, columns_;
  TraceCounts& counts_;
  std::vector<Span> few_, spans_;  // For light that is hardly spread, and for all light of the tile.
  TileView whole_;                 // A sample for each pixel, at the wavelengths of `few_` and `spans_`.
  std::vector<double> sweeps_;     // By pixel: the length of the line that it sees, in pixels. Infinite: it is not one,
                                   // or one sample does not tell what the pixel sees of it.
  TileView few_samples_, samples_;  // All samples of the pixels that need them: at `few_`, and at all wavelengths.
};

}  // namespace tensorray
