#include "renderer/camera/pixel_filter.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/constants.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;

constexpr PixelFilterShape all_shapes[] = {PixelFilterShape::box, PixelFilterShape::gaussian,
                                           PixelFilterShape::blackman_harris};

/// One of the two factors of a filter with the radius 1.5 at x, divided by its value at 0.
double profile(PixelFilterShape shape, double x) {
  const double cosine = std::cos(pi * x / 1.5), edge = std::exp(-4.5);
  if (shape == PixelFilterShape::gaussian) return (std::exp(-2 * x * x) - edge) / (1 - edge);
  if (shape == PixelFilterShape::box) return 1;
  return 0.35875 + 0.48829 * cosine + 0.14128 * std::cos(2 * pi * x / 1.5) + 0.01168 * std::cos(3 * pi * x / 1.5);
}

/// The midpoint rule; its error for these profiles is far below 1e-7.
double integrate(PixelFilterShape shape, double from, double to) {
  constexpr int steps = 4000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) sum += profile(shape, from + (to - from) * (i + 0.5) / steps);
  return sum * (to - from) / steps;
}

TEST(PixelFilter, UsualRadii) {
  EXPECT_EQ(PixelFilter(PixelFilterShape::box).radius(), 0.5);
  EXPECT_EQ(PixelFilter(PixelFilterShape::gaussian).radius(), 1.5);
  EXPECT_EQ(PixelFilter(PixelFilterShape::blackman_harris).radius(), 1.5);
}

TEST(PixelFilter, SamplesAreQuantilesOfTheShape) {
  for (const PixelFilterShape shape : all_shapes) {
    const PixelFilter filter(shape, 1.5);
    const double whole = integrate(shape, -1.5, 1.5);
    double last = -1.5;
    for (const double u : {0.0, 1e-9, 1e-4, 0.003, 0.1, 0.25, 0.4999, 0.5, 0.6, 0.77, 0.999, 1 - 1e-6, 1 - 0x1p-32}) {
      const Vector2d offset = filter.sample({u, 1 - u});
      EXPECT_NEAR(integrate(shape, -1.5, offset.x()) / whole, u, 1e-6);
      EXPECT_NEAR(offset.y(), -offset.x(), 1e-6);
      EXPECT_GE(offset.x(), last);
      EXPECT_LE(offset.x(), 1.5);
      last = offset.x();
      // Other radii scale the same shape.
      EXPECT_NEAR(PixelFilter(shape, 3).sample({u, 0}).x(), 2 * offset.x(), 1e-7);
    }
  }
}

}  // namespace
}  // namespace tensorray
