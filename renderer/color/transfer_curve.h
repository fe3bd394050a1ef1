#pragma once
/// @file renderer/color/transfer_curve.h
/// The curve from the values that a picture stores to light.

#include <vector>

namespace tensorray {

/// A table, or the function of ICC.1 (parametricCurveType 4) if there is no table:
///   y = (a x + b)^g + e where x >= d, y = c x + f below. The default is y = x.
struct TransferCurve {
  std::vector<float> table;  ///< At least two values at equal distances from x = 0 to 1, with lines between them.
  double g = 1, a = 1, b = 0, c = 0, d = 0, e = 0, f = 0;

  /// Tables end at 0 and 1. Below zero, a curve with c = 0 is mirrored, as linear light may be negative.
  float at(float x) const;
};

TransferCurve srgb_curve();               ///< IEC 61966-2-1.
TransferCurve power_curve(double gamma);  ///< y = x^gamma.

}  // namespace tensorray
