#include "renderer/camera/pixel_filter.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/constants.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;

constexpr PixelFilterShape all_shapes[] = {PixelFilterShape::box, PixelFilterShape::gaussian,
                                           PixelFilterShape::blackman_harris};

constexpr double radius = 1.5;  // Of the box, half a pixel.

/// One of the two factors of the filter at x, divided by its value at 0.
double profile(PixelFilterShape shape, double x) {
  const double cosine = std::cos(pi * x / radius), edge = std::exp(-4.5);
  if (shape == PixelFilterShape::gaussian) return (std::exp(-2 * x * x) - edge) / (1 - edge);
  if (shape == PixelFilterShape::box) return std::abs(x) <= 0.5 ? 1 : 0;
  return 0.35875 + 0.48829 * cosine + 0.14128 * std::cos(2 * pi * x / radius) + 0.01168 * std::cos(3 * pi * x / radius);
}

/// The midpoint rule; its error for these profiles is far below 1e-7.
double integrate(PixelFilterShape shape, double from, double to) {
  constexpr int steps = 4000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) sum += profile(shape, from + (to - from) * (i + 0.5) / steps);
  return sum * (to - from) / steps;
}

TEST(PixelFilter, SamplesAreQuantilesOfTheShape) {
  for (const PixelFilterShape shape : all_shapes) {
    const PixelFilter filter(shape);
    const double end = shape == PixelFilterShape::box ? 0.5 : radius, whole = integrate(shape, -end, end);
    double last = -end;
    for (const double u : {0.0, 1e-9, 1e-4, 0.003, 0.1, 0.25, 0.4999, 0.5, 0.6, 0.77, 0.999, 1 - 1e-6, 1 - 0x1p-32}) {
      const Vector2d offset = filter.sample({u, 1 - u});
      EXPECT_NEAR(integrate(shape, -end, offset.x()) / whole, u, 1e-6);
      EXPECT_NEAR(offset.y(), -offset.x(), 1e-6);
      EXPECT_GE(offset.x(), last);
      EXPECT_LE(offset.x(), end);
      last = offset.x();
    }
  }
}

}  // namespace
}  // namespace tensorray
