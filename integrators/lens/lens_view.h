#pragma once
/// What the points of a lens's picture see of the image, in all of its light, and the light of its pixels.

#include <vector>

#include <Eigen/Geometry>

#include "integrators/lens/lens.h"
#include "tracing/flow_drawing/flow_view.h"

namespace tensorray {

/// Bands that follow each other, from `first` to `last`, without it. Their light sees what light of LensView's
/// wavelengths `from` and `to` (indices) sees, and what is between.
struct Span {
  std::size_t first, last, from, to;
  double part = 1;  ///< Of the light of the bands; less than 1: the span is a part of one band.

  /// In bands.
  double width() const { return part * static_cast<double>(last - first); }
};

/// A wavelength that can be looked at.
struct LensWavelength {
  double place;       ///< Among the map's wavelength samples.
  std::size_t range;  ///< Of LensView::flow: a band, or the reference.
};

/// The light of a lens, ready to be looked at. Immutable; threads share it.
struct LensView {
  const LensLight& light;
  const std::vector<LensBand>& bands;
  const LensRadiance& radiance;
  Eigen::Affine2d starts;    ///< From coordinates to pixels, in the plane where the map's light starts in `gather`.
  Eigen::Affine2d landings;  ///< From coordinates to pixels, in the plane where it lands.
  std::vector<Span> spans;   ///< Each band.
  std::vector<LensWavelength> wavelengths;  ///< The ends of bands and of their parts; the reference.
  std::vector<std::vector<Span>> parts;     ///< Of each band that is a range, in equal parts; else empty.
  std::size_t reference;                    ///< Index of the wavelength.
  double straight_pixel;                    ///< The change of (s, t) per pixel for straight light, at most.
  FlowView flow;
};

/// `light`, `bands` and `radiance` must outlive the result.
LensView make_lens_view(const LensLight& light, const std::vector<LensBand>& bands, const LensRadiance& radiance);

/// About `count` spans, which together are all of `spans`. Outside a range they have nothing in common and stay apart.
std::vector<Span> joined(const std::vector<Span>& spans, std::size_t count);

/// What the samples of a tile see, by wavelength and sample; empty for wavelengths that are not drawn.
using TileView = std::vector<std::vector<FlowPoint>>;

/// What the samples of a tile see at the wavelengths of `spans`. In `gather`, light that is unknown is traced.
/// @param n       Samples of a pixel along x and along y.
/// @param wanted  By pixel of the tile: whether its samples are wanted. Empty: all are.
TileView view_tile(const LensView& view, int tile, int n, const std::vector<Span>& spans,
                   const std::vector<char>& wanted, TraceCounts& counts);

/// Coordinates, in the image's plane, of what a point sees; its light landed.
Eigen::Vector2d image_point(const LensView& view, const FlowPoint& point);

/// The change of these coordinates per pixel, along x and y.
Eigen::Matrix2d image_by_pixel(const LensView& view, const FlowPoint& point);

/// (s, t) of coordinates in the image's plane.
Eigen::Vector2d texture_coordinates(const LensLight& light, const Eigen::Vector2d& at);

bool sees_image(const LensLight& light, const Eigen::Vector2d& st);

bool gathers(const LensLight& light);

/// From coordinates in a plate's plane to its pixels.
Eigen::Affine2d to_pixels(const Plate& plate);

/// The place among the map's wavelength samples of one between the first flexibility (0) and the last (1).
double sample_place(const LensLight& light, double place);

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

  /// Adds the light of a pixel to `light`. Spread over several pixels of the image, one sample is enough.
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
