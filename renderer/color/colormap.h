#pragma once
/// @file renderer/color/colormap.h
/// Colours for numbers: perceptually uniform maps, and the range of values that a map is laid over.

#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Equal steps of the value look equally large; lightness rises all along the sequential maps, so that they also read
/// in grey. Each goes through control points of the published table, here rounded to 8 bits:
/// - `viridis`, `magma`, `inferno`, `plasma` (dark to light): S. van der Walt and N. Smith 2015, CC0, as in matplotlib.
/// - `cividis` (blue to yellow, the same to readers with a colour vision deficiency): J. Nuñez, C. Anderton and
///   R. Renslow, Optimizing colormaps with consideration for color vision deficiency, PLOS ONE 13(7), 2018.
/// - `cool_warm` (blue, white, red: diverging from the middle): K. Moreland, Diverging color maps for scientific
///   visualization, ISVC 2009; the table of 33 colours that comes with it.
/// - `twilight` (cyclic: 1 is the colour of 0, so for angles): B. Bechtold 2017, CC0, as in matplotlib.
/// - `grey`: CIE lightness L* = 100 x.
enum class Colormap { viridis, magma, inferno, plasma, cividis, cool_warm, twilight, grey };

/// The colour at x, from 0 to 1, as sRGB values from 0 to 1. Smooth (a cubic spline through the control points), within
/// 1.5/255 of the published tables; of those that have corners within 2.5/255 (`twilight`) and 3.5/255 (`cividis`). x
/// is clamped; not a number counts as 0. Any thread may call it.
Eigen::Vector3d colormap_srgb(Colormap map, double x);

/// The same colour as light: linear, with the primaries of Rec.709.
Eigen::Vector3d colormap_linear(Colormap map, double x);

/// From sRGB values to linear Rec.709, each channel (IEC 61966-2-1).
Eigen::Vector3d srgb_to_linear(const Eigen::Vector3d& srgb);

/// The other way; values outside [0, 1] are clamped.
Eigen::Vector3d linear_to_srgb(const Eigen::Vector3d& linear);

/// The values that a map's two ends stand for.
struct ValueRange {
  double low = 0;
  double high = 1;           ///< > low.
  bool logarithmic = false;  ///< Equal ratios, rather than differences, are equally far apart; then low > 0.

  /// Where a value lies in the range: 0 at `low`, 1 at `high`, clamped. Not a number gives 0, and so does what has no
  /// logarithm.
  double position(double value) const;

  /// The value at a position from 0 to 1.
  double value(double position) const;
};

struct RangeChoice {
  double low_percentile = 1;  ///< 0 and 100: all values.
  double high_percentile = 99;
  bool logarithmic = false;
  bool symmetric = false;  ///< About zero, so that the middle of a diverging map is zero; not with `logarithmic`.
};

/// A range for data: between two percentiles (linear between ranks), so that a few stray values do not use up all
/// colours. Values that are not finite are left out, on a logarithmic scale also those that are not above zero. Where
/// the percentiles coincide all values are taken; where these are all the same (or too close to be told apart), a range
/// about them: half as large again on both sides, or from a half to twice the value on a logarithmic scale. Without any
/// value, and for zeros, it is 0 to 1 (symmetric: −1 to 1; logarithmic: 1 to 10).
/// @throw std::invalid_argument unless 0 ≤ low_percentile < high_percentile ≤ 100, or if both symmetric and
/// logarithmic.
ValueRange choose_range(std::vector<double> values, const RangeChoice& choice = {});

}  // namespace tensorray
