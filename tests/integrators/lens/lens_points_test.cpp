// What the pixels of a lens's picture see: the map to the image, its folds, and its two modes.

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "tests/integrators/lens_support.h"

namespace tensorray {
namespace {

using namespace test;

TEST(Lens, PointsDescribeTheMapFromPixelsToTheImage) {
  const Vector2i size(64, 48);
  // Zero in the middle, so that light stays off the volume's sides, where the map has kinks.
  const auto tensor = [](const Vector3d& p) -> Matrix3d { return linear_tensor(p) - general_tensor(); };
  Bench bench(cube_field(9, tensor), plate_at(1.5, {0.8, 0.6}, size), {4, 5}, noise(16, 16));
  for (const LensMode mode : modes) {
    const LensPicture seen = bench.simulate(mode, mode == LensMode::gather ? 0.3 : -0.3);  // About the same picture.
    double least = 1e9, greatest = -1e9;
    for (int y = 1; y + 1 < size.y(); ++y)
      for (int x = 1; x + 1 < size.x(); ++x) {
        const LensPoint& point = point_at(seen, x, y);
        ASSERT_EQ(point.end, LensEnd::image);
        Matrix2d difference;
        difference << (point_at(seen, x + 1, y).st - point_at(seen, x - 1, y).st) / 2,
            (point_at(seen, x, y + 1).st - point_at(seen, x, y - 1).st) / 2;
        // In `scatter`, (s, t) is linear within a triangle: the error of its slope is half of the Jacobian's change
        // across it.
        const double tolerance = mode == LensMode::gather ? 0.01 : 0.03;
        ASSERT_LT((difference - point.per_pixel).norm(), tolerance * point.per_pixel.norm()) << x << " " << y;

        const Vector2d pixel = bench.receiver.pixel_size();
        const Matrix2d image_by_receiver = bench.image.plane.size.asDiagonal() * point.per_pixel *
                                           Vector2d(1 / pixel.x(), -1 / pixel.y()).asDiagonal();
        EXPECT_NEAR(point.log_magnification, -std::log(std::abs(image_by_receiver.determinant())), 1e-9);
        EXPECT_NEAR(point.log_stretch[0] + point.log_stretch[1], point.log_magnification, 1e-12);
        EXPECT_GE(point.log_stretch[0], point.log_stretch[1]);
        EXPECT_NEAR(std::exp(-2 * point.log_stretch[0]) + std::exp(-2 * point.log_stretch[1]),
                    image_by_receiver.squaredNorm(), 1e-9);
        const Vector2d moved = (point.st - seen.straight * Vector2d(x + 0.5, y + 0.5)).cwiseProduct(Vector2d(4, 5));
        EXPECT_LT((point.displacement - Vector3d(moved.x(), moved.y(), 0)).norm(), 1e-9);
        least = std::min(least, point.log_magnification);
        greatest = std::max(greatest, point.log_magnification);
      }
    EXPECT_GT(greatest - least, 0.2);  // There is distortion, and it varies.
  }
}

/// Converges light along +z within |x| < ½, less and less outside; it acts on x alone, and is linear between voxels.
TensorField converging_field(double k) {
  return cube_field(9, [k](const Vector3d& p) {
    const double x = std::abs(p.x());
    Matrix3d T = Matrix3d::Zero();
    T(0, 2) = -k * std::copysign(x < 0.5 ? x : 1 - x, p.x());
    return T;
  });
}

/// The map x → x' of a field that acts on x alone, sampled at closely spaced starts.
struct Scan {
  std::vector<double> starts, landings;

  Scan(const Bench& bench, double s) {
    const LensMap map(bench.field, bench.surfaces, bench.bending, bench.image.plane, bench.receiver, {0, 0, 1});
    for (double x = -1.5; x < 1.5; x += 1e-3) {
      LensLanding landing;
      map.trace({{x, 0}}, {s}, &landing);
      starts.push_back(x);
      landings.push_back(landing.at.x());
    }
  }

  /// All starts that land at `at`.
  std::vector<double> find(double at) const {
    std::vector<double> found;
    for (std::size_t i = 0; i + 1 < starts.size(); ++i) {
      const double a = landings[i] - at, b = landings[i + 1] - at;
      if ((a < 0) != (b < 0)) found.push_back(starts[i] + (starts[i + 1] - starts[i]) * a / (a - b));
    }
    return found;
  }

  /// The number of starts that land at `at`; 0 if that number changes within `margin`.
  int count(double at, double margin) const {
    const std::size_t low = find(at - margin).size(), high = find(at + margin).size();
    return low == high ? static_cast<int>(low) : 0;
  }
};

TEST(Lens, ThreeSheetsBeyondTheFocus) {
  const double s = 0.4, k = 2.5, pixel = 0.04;
  Bench bench(converging_field(k), plate_at(1.5, {2.4, 0.4}, {60, 10}), {2.8, 0.8}, noise(64, 16));
  const Scan scan(bench, s);
  const double magnified = std::cos(2.0) - 0.5 * std::sin(2.0);  // On the axis, x'' = −s k x.
  for (const LensMode mode : modes) {
    const LensPicture seen = bench.simulate(mode, s);
    int threefold = 0, single = 0;
    for (int x = 0; x < 60; ++x) {
      const LensPoint& point = point_at(seen, x, 5);
      const double at = (x + 0.5) * pixel - 1.2;
      const double target = mode == LensMode::scatter ? at : (point.st.x() - 0.5) * 2.8;
      ASSERT_EQ(point.end, LensEnd::image) << x;
      EXPECT_TRUE(std::isfinite(seen.radiance.plane(0)[5 * 60 + x]));
      const int count = scan.count(target, 0.5 * pixel);
      // In `gather` the target is the point of the picture. The map is the same one, because the planes are at equal
      // distances.
      if (count == 0) continue;
      EXPECT_EQ(point.folds, count) << x;
      ++(count == 3 ? threefold : single);
      if (mode == LensMode::gather) continue;
      const std::vector<double> found = scan.find(at);
      const double nearest = *std::min_element(found.begin(), found.end(),
                                               [&](double a, double b) { return std::abs(a - at) < std::abs(b - at); });
      EXPECT_NEAR((point.st.x() - 0.5) * 2.8, nearest, 0.3 * pixel) << x;
    }
    EXPECT_GT(threefold, 10);
    EXPECT_GT(single, 4);
    const double expected = mode == LensMode::scatter ? 1 / magnified : magnified;
    EXPECT_NEAR(point_at(seen, 30, 5).per_pixel(0, 0) * 2.8 / pixel, expected, 0.02 * std::abs(expected));
  }
}

double largest_difference(const LensPicture& a, const LensPicture& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    EXPECT_EQ(a.points[i].end, LensEnd::image);
    EXPECT_EQ(b.points[i].end, LensEnd::image);
    largest = std::max(largest, (a.points[i].st - b.points[i].st).norm());
  }
  return largest;
}

}  // namespace
}  // namespace tensorray
