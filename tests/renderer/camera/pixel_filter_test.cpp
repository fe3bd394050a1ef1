#include "renderer/camera/pixel_filter.h"

#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "renderer/sampling/random.h"
#include "tests/renderer/statistics.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;

constexpr PixelFilterShape all_shapes[] = {PixelFilterShape::box, PixelFilterShape::gaussian,
                                           PixelFilterShape::blackman_harris};

/// One of the two factors of the filter at x, divided by its value at 0. density() shows no more than this ratio.
double profile(const PixelFilter& filter, double x) { return filter.density({x, 0}) / filter.density({0, 0}); }

/// The midpoint rule; its error for these profiles is far below 1e-7.
double integrate(const PixelFilter& filter, double from, double to) {
  constexpr int steps = 4000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) sum += profile(filter, from + (to - from) * (i + 0.5) / steps);
  return sum * (to - from) / steps;
}

TEST(PixelFilter, HasTheNamedShape) {
  const PixelFilter box(PixelFilterShape::box), gaussian(PixelFilterShape::gaussian),
      harris(PixelFilterShape::blackman_harris);
  EXPECT_EQ(box.radius(), 0.5);
  EXPECT_EQ(box.density({0.4, -0.3}), 1);
  EXPECT_EQ(gaussian.radius(), 1.5);
  const double edge = std::exp(-4.5);
  EXPECT_NEAR(profile(gaussian, 0.5), (std::exp(-0.5) - edge) / (1 - edge), 1e-14);
  EXPECT_NEAR(profile(gaussian, 1.5), 0, 1e-14);
  EXPECT_EQ(harris.radius(), 1.5);
  EXPECT_NEAR(harris.density({0, 0}), std::pow(1 / (2 * 0.35875 * 1.5), 2), 1e-14);
  EXPECT_NEAR(profile(harris, 0.75), 0.35875 - 0.14128, 1e-14);  // Half way the cosines are 0, −1, 0.
  EXPECT_NEAR(profile(harris, 1.5), 6e-5, 1e-14);                // From Harris' table.
  for (const Vector2d& p : {Vector2d(0.3, 0.7), Vector2d(1.2, -0.1)}) {
    EXPECT_DOUBLE_EQ(harris.density(p), harris.density(-p));
    EXPECT_DOUBLE_EQ(harris.density(p), harris.density({p.y(), p.x()}));
  }
}

TEST(PixelFilter, SamplesAreQuantilesOfTheDensity) {
  for (const PixelFilterShape shape : all_shapes) {
    const PixelFilter filter(shape, 1.5);
    const double whole = integrate(filter, -1.5, 1.5);
    double last = -1.5;
    for (const double u : {0.0, 1e-9, 1e-4, 0.003, 0.1, 0.25, 0.4999, 0.5, 0.6, 0.77, 0.999, 1 - 1e-6, 1 - 0x1p-32}) {
      const Vector2d offset = filter.sample({u, 1 - u});
      EXPECT_NEAR(integrate(filter, -1.5, offset.x()) / whole, u, 1e-6);
      EXPECT_NEAR(offset.y(), -offset.x(), 1e-6);
      EXPECT_GE(offset.x(), last);
      EXPECT_LE(offset.x(), 1.5);
      last = offset.x();
    }
  }
}

}  // namespace
}  // namespace tensorray
