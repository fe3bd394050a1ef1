#pragma once
/// Colours for numbers: perceptually uniform colour maps, and the range of values that a map covers.

#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Colour maps in which equal steps of the value look equally large. In sequential maps lightness increases, so that
/// they also work in grey. Each map interpolates control points of the published table, rounded to 8 bits:
/// - `viridis`, `magma`, `inferno`, `plasma` (dark to light): S. van der Walt and N. Smith 2015, CC0, as in matplotlib.
/// - `cividis` (blue to yellow, the same to readers with a colour vision deficiency): J. Nuñez, C. Anderton and
///   R. Renslow, Optimizing colormaps with consideration for color vision deficiency, PLOS ONE 13(7), 2018.
/// - `cool_warm` (blue, white, red: diverging from the middle): K. Moreland, Diverging color maps for scientific
///   visualization, ISVC 2009; the table of 33 colours that comes with it.
/// - `twilight` (cyclic: 1 is the colour of 0, so for angles): B. Bechtold 2017, CC0, as in matplotlib.
/// - `grey`: CIE lightness L* = 100 x.
enum class Colormap { viridis, magma, inferno, plasma, cividis, cool_warm, twilight, grey };

/// The colour at x (0 to 1) as sRGB values from 0 to 1. It is smooth (a cubic spline through the control points). The
/// error against the published tables is at most 1.5/255; for tables with corners it is 2.5/255 (`twilight`) and
/// 3.5/255 (`cividis`). x is clamped; NaN counts as 0. Any thread may call it.
Eigen::Vector3d colormap_srgb(Colormap map, double x);

/// The same colour in linear Rec.709.
Eigen::Vector3d colormap_linear(Colormap map, double x);

/// Converts sRGB values to linear Rec.709, channel by channel (IEC 61966-2-1).
Eigen::Vector3d srgb_to_linear(const Eigen::Vector3d& srgb);

/// The inverse of srgb_to_linear; values outside [0, 1] are clamped.
Eigen::Vector3d linear_to_srgb(const Eigen::Vector3d& linear);

/// The values at the two ends of a colour map.
struct ValueRange {
  double low = 0;
  double high = 1;           ///< > low.
  bool logarithmic = false;  ///< Equal ratios of values, not equal differences, have equal distances; low > 0.

  /// Where a value lies in the range: 0 at `low`, 1 at `high`, clamped. NaN gives 0; on a logarithmic scale a value
  /// without logarithm also gives 0.
  double position(double value) const;

  /// The value at a position from 0 to 1.
  double value(double position) const;
};

struct RangeChoice {
  double low_percentile = 1;  ///< 0 and 100 include all values.
  double high_percentile = 99;
  bool logarithmic = false;
  bool symmetric = false;  ///< Centre the range at zero, for diverging maps; not together with `logarithmic`.
};

/// Chooses a range for data: from one percentile to another (linear between ranks), so that a few outliers do not use
/// up most of the colours. Values that are not finite are ignored; on a logarithmic scale, values that are not above
/// zero too. If the two percentiles are equal, the range covers all values. If all values are equal (or too close to be
/// distinguished), the range surrounds them: it extends by half of the value to both sides, or on a logarithmic scale
/// from half to twice the value. Without values but zero it is 0 to 1 (−1 to 1; 1 to 10).
/// @throw std::invalid_argument unless 0 ≤ low_percentile < high_percentile ≤ 100, or if symmetric and logarithmic.
ValueRange choose_range(std::vector<double> values, const RangeChoice& choice = {});

}  // namespace tensorray
