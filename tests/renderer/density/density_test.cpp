#include "renderer/density/density.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>

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

/// The most that the power of a point changes by rounding: by half a quantum at each pixel of its kernel.
double most_rounded(const DensitySettings& settings) {
  if (settings.kind == DensityKind::histogram) return 0;  // Ones are exact.
  const double taps = settings.tau < 2 ? 2 * (std::floor(4.5 * settings.tau + 0.5) + 1) : spline_taps;
  return taps * taps * std::ldexp(0.5, -26);
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
      EXPECT_NEAR(sum(estimate(40, 30, {kind, tau}, points)), 1000, (1e-12 + most_rounded({kind, tau})) * 1000) << tau;
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
      EXPECT_NEAR(sum(planes), 0.5 * 60000, (1e-12 + most_rounded({kind, tau})) * 0.5 * 60000);
      double greatest = 0;
      for (const double value : rgb.values) greatest = std::max(greatest, value);
      for (std::size_t i = 0; i < rgb.plane_size(); ++i)
        for (int c = 0; c < 3; ++c) {
          double expected = 0;
          for (int k = 0; k < 3; ++k) expected += planes.plane(k)[i] * colors[k][c];
          // Rounding removes the ends of kernels, which are below half a quantum.
          ASSERT_NEAR(rgb.plane(c)[i], expected, 1e-7 * greatest) << tau;
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
    EXPECT_NEAR(sum(estimate(2, 1, {DensityKind::gaussian, tau}, {{0.3, 0.4}, {1.9, 0.9}})), 2,
                2 * (1e-12 + most_rounded({DensityKind::gaussian, tau})))
        << tau;
}

std::string sums_of(DensityEstimator estimator) {
  Archive archive;
  estimator.copy_sums(archive);
  return archive.take();
}

void add_sums(const std::string& sums, DensityEstimator& estimator) {
  Archive archive(sums);
  estimator.copy_sums(archive);
  archive.finish();
}

/// Estimators of each kind, with and without colours.
std::vector<DensityEstimator> all_kinds(int width, int height) {
  const std::vector<Eigen::Vector3d> rgb{{0.3, 0.02, 0}, {-0.1, 0.9, 0.3}, {0, 1e-4, 2}};
  std::vector<DensityEstimator> estimators;
  for (const std::vector<Eigen::Vector3d>& colors : {rgb, std::vector<Eigen::Vector3d>()})
    for (const DensitySettings& settings :
         {DensitySettings{DensityKind::histogram}, DensitySettings{DensityKind::gaussian, 0.8},
          DensitySettings{DensityKind::gaussian, 3}})
      estimators.emplace_back(width, height, 3, settings, colors);
  return estimators;
}

TEST(Density, SumsDependNeitherOnTheOrderOfPointsNorOnParts) {
  constexpr int width = 150, height = 101, parts = 5;
  for (const DensityEstimator& empty : all_kinds(width, height)) {
    std::vector<DensityPoint> points = channel_points(empty, width, height);
    DensityEstimator all = empty, other = empty, joined = empty;
    all.add(points);
    std::shuffle(points.begin(), points.end(), std::mt19937(2));
    other.add(points);
    EXPECT_EQ(sums_of(all), sums_of(other));
    for (std::size_t part = parts; part-- > 0;) {
      DensityEstimator some = empty;
      std::vector<DensityPoint> mine;
      for (std::size_t i = part; i < points.size(); i += parts) mine.push_back(points[i]);
      some.add(mine);
      add_sums(sums_of(some), joined);
    }
    EXPECT_EQ(sums_of(all), sums_of(joined));
    EXPECT_EQ(all.finish(0.3).values, joined.finish(0.3).values);
  }
}

/// A pixel has 2^26 points of the brightest colour.
TEST(Density, SumsOfManyPointsAreExact) {
  constexpr int size = 9, doublings = 26;
  for (const DensityEstimator& empty : all_kinds(size, size)) {
    std::vector<DensityPoint> points;
    for (const Eigen::Vector2d& at : random_points(2000, size, size)) points.push_back(empty.point(2, at));
    DensityEstimator some = empty, before = empty;
    some.add(points);
    before.add({empty.point(2, {4.6, 4.7})});
    for (int i = 0; i < doublings; ++i) add_sums(sums_of(before), before);
    DensityEstimator after = before;
    for (const DensityPoint& point : points) after.add({point});
    add_sums(sums_of(some), before);
    EXPECT_EQ(sums_of(before), sums_of(after));
  }
}

TEST(Density, RefusesSumsOfAnotherEstimator) {
  const DensityEstimator one(5, 5, 1, {});
  DensityEstimator other(5, 6, 1, {});
  EXPECT_THROW(add_sums(sums_of(one), other), std::runtime_error);
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
