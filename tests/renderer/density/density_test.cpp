#include "renderer/density/density.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "base/constants.h"

namespace tensorray {
namespace {

using Points = std::vector<Eigen::Vector2d>;

void add(DensityEstimator& estimator, int channel, const Points& points) {
  std::vector<DensityPoint> made;
  for (const Eigen::Vector2d& point : points) made.push_back(estimator.point(channel, point));
  estimator.add(made);
}

Film estimate(int width, int height, const DensitySettings& settings, const Points& points) {
  DensityEstimator estimator(width, height, 1, settings);
  add(estimator, 0, points);
  return std::move(estimator).finish();
}

Points random_points(int count, double width, double height) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> x(0, width), y(0, height);
  Points points;
  for (int i = 0; i < count; ++i) points.emplace_back(x(random), y(random));
  return points;
}

/// Evaluates Eq. 10, corrected, directly: a sum over all points and their mirror images in the edges of the plate.
Film direct_sum(int width, int height, double tau, const Points& points) {
  Film film(width, height, 1);
  const auto line = [tau](double at, double center, double size) {
    double sum = 0;
    for (int period = -2; period <= 2; ++period)
      for (const double image : {2 * size * period + center, 2 * size * period - center})
        sum += std::exp(-(at - image) * (at - image) / (2 * tau * tau));
    return sum;
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (const Eigen::Vector2d& p : points)
        film.values[y * width + x] += line(x + 0.5, p.x(), width) * line(y + 0.5, p.y(), height) / (2 * pi * tau * tau);
  return film;
}

double sum(const Film& film) {
  double total = 0;
  for (const double value : film.values) total += value;
  return total;
}

TEST(Density, AgreesWithTheDirectSum) {
  const Points points = random_points(60, 97, 64);
  for (const double tau : {0.7, 1.0, 1.5, 2.0, 6.0, 13.0}) {
    DensitySettings settings;
    settings.tau = tau;
    const Film fast = estimate(97, 64, settings, points), direct = direct_sum(97, 64, tau, points);
    double greatest = 0, error = 0;
    for (std::size_t i = 0; i < fast.values.size(); ++i) {
      greatest = std::max(greatest, direct.values[i]);
      error = std::max(error, std::abs(fast.values[i] - direct.values[i]));
    }
    // Below tau = 1 the sum of a sampled Gaussian over the pixels is not 1, and normalising it changes the values: by 2
    // exp(−2π²τ²) per axis, which is 1.3e-4 at 0.7.
    EXPECT_LT(error, (tau < 1 ? 1e-3 : tau < 6 ? 2e-4 : 5e-5) * greatest) << tau;
  }
}

TEST(Density, ConservesEveryPoint) {
  const Points points = random_points(1000, 40, 30);
  for (const double tau : {0.3, 1.0, 1.5, 6.0, 25.0})
    for (const DensityKind kind : {DensityKind::gaussian, DensityKind::histogram})
      EXPECT_NEAR(sum(estimate(40, 30, {kind, tau}, points)), 1000, 1e-9 * 1000) << tau;
}

TEST(Density, UniformLightIsUniformUpToTheEdges) {
  // Lattices of points that do not match the pixels. The coarsest ones have fewer points than pixels.
  for (const double spacing : {0.37, 0.95, 1.0, 1.05, 2.1, 4.0}) {
    const int count = static_cast<int>(120 / spacing);
    const double step = 120.0 / count;
    Points points;
    for (int y = 0; y < count; ++y)
      for (int x = 0; x < count; ++x) points.emplace_back((x + 0.5) * step, (y + 0.5) * step);
    const Film film = estimate(120, 120, {}, points);
    const double mean = sum(film) / static_cast<double>(film.values.size());
    for (const double value : film.values) ASSERT_NEAR(value, mean, 5e-7 * mean) << spacing;
  }
}

TEST(Density, HistogramCountsInThePixel) {
  const Film film = estimate(4, 3, {DensityKind::histogram, 6}, {{0.5, 0.5}, {3.9, 2.1}, {3.1, 2.9}, {4.0, 3.0}});
  EXPECT_EQ(film.values[0], 1);
  EXPECT_EQ(film.values[2 * 4 + 3], 3);  // The far corner belongs to the last pixel.
  EXPECT_EQ(sum(film), 4);
}

TEST(Density, ChannelsAreSeparate) {
  DensityEstimator estimator(20, 20, 3, {});
  add(estimator, 1, {{10, 10}});
  const Film film = std::move(estimator).finish();
  for (std::size_t i = 0; i < film.plane_size(); ++i) {
    EXPECT_EQ(film.plane(0)[i], 0);
    EXPECT_EQ(film.plane(2)[i], 0);
  }
}

/// Points of three channels: more than are sorted at once, and most of them on a small part of the plate.
std::vector<DensityPoint> channel_points(const DensityEstimator& estimator, int width, int height) {
  const Points spread = random_points(20000, width, height), dense = random_points(60000, 30, 20);
  std::vector<DensityPoint> points;
  for (std::size_t i = 0; i < dense.size(); ++i) {
    const Eigen::Vector2d at = i < spread.size() ? spread[i] : Eigen::Vector2d(dense[i] + Eigen::Vector2d(40, 50));
    points.push_back(estimator.point(static_cast<int>(i % 3), at));
    if (i % 5 == 0) points.push_back({});  // An unused point.
  }
  return points;
}

TEST(Density, ColoursAreThoseOfTheChannelsPlanes) {
  const std::vector<Eigen::Vector3d> colors{{1, 0.2, 0}, {-0.1, 0.9, 0.3}, {0, 0, 2}};
  constexpr int width = 150, height = 101;
  for (const DensityKind kind : {DensityKind::gaussian, DensityKind::histogram})
    for (const double tau : {0.8, 3.0}) {
      DensityEstimator colored(width, height, 3, {kind, tau}, colors), plain(width, height, 3, {kind, tau});
      const std::vector<DensityPoint> points = channel_points(plain, width, height);
      colored.add(points);
      plain.add(points);
      const Film rgb = std::move(colored).finish(0.5), planes = std::move(plain).finish(0.5);
      ASSERT_EQ(rgb.channels, 3);
      EXPECT_NEAR(sum(planes), 0.5 * 60000, 1e-6);
      double greatest = 0;
      for (const double value : rgb.values) greatest = std::max(greatest, value);
      for (std::size_t i = 0; i < rgb.plane_size(); ++i)
        for (int c = 0; c < 3; ++c) {
          double expected = 0;
          for (int k = 0; k < 3; ++k) expected += planes.plane(k)[i] * colors[k][c];
          ASSERT_NEAR(rgb.plane(c)[i], expected, 1e-12 * greatest) << tau;
        }
    }
}

TEST(Density, IsTheSameOnAnyNumberOfThreads) {
  const std::vector<Eigen::Vector3d> rgb{{1, 0.2, 0}, {-0.1, 0.9, 0.3}, {0, 0, 2}};
  for (const std::vector<Eigen::Vector3d>& colors : {rgb, std::vector<Eigen::Vector3d>()})
    for (const double tau : {0.8, 3.0}) {
      const auto on_threads = [&](int threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        DensityEstimator estimator(300, 200, 3, {DensityKind::gaussian, tau}, colors);
        const std::vector<DensityPoint> points = channel_points(estimator, 300, 200);
        estimator.add(points);
        estimator.add(points);
        return std::move(estimator).finish();
      };
      const Film one = on_threads(1);
      for (const int threads : {2, 8}) EXPECT_EQ(one.values, on_threads(threads).values) << tau;
    }
}

TEST(Density, PlatesSmallerThanTheKernelWork) {
  for (const double tau : {1.0, 6.0, 100.0})
    EXPECT_NEAR(sum(estimate(2, 1, {DensityKind::gaussian, tau}, {{0.3, 0.4}, {1.9, 0.9}})), 2, 1e-12) << tau;
}

TEST(Density, RefusesSettingsOutOfRange) {
  EXPECT_THROW(DensityEstimator(0, 5, 1, {}), std::invalid_argument);
  EXPECT_THROW(DensityEstimator(5, 5, 0, {}), std::invalid_argument);
  EXPECT_THROW(DensityEstimator(65001, 1, 1, {}), std::invalid_argument);
  EXPECT_THROW(DensityEstimator(5, 5, 2, {}, {{1, 1, 1}}), std::invalid_argument);
  EXPECT_THROW(DensityEstimator(5, 5, 1, {DensityKind::gaussian, 0}), std::invalid_argument);
  EXPECT_THROW(DensityEstimator(5, 5, 1, {DensityKind::gaussian, std::nan("")}), std::invalid_argument);
}

}  // namespace
}  // namespace tensorray
