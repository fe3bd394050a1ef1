#include "renderer/density/density.h"

#include <random>
#include <stdexcept>

#include "base/constants.h"
#include "tests/names.h"

namespace tensorray {
namespace {

using Points = std::vector<Vector2d>;

const DensitySettings footprints{DensityKind::photon_differential};
constexpr double widening = 0.4;  // Pixels; see DensityEstimator::add.

Film estimate(int width, int height, const DensitySettings& settings, const Points& points) {
  DensityEstimator estimator(width, height, 1, settings);
  for (const Vector2d& point : points) estimator.add(0, point);
  return estimator.finish();
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
      for (const Vector2d& p : points)
        film.values[y * width + x] += line(x + 0.5, p.x(), width) * line(y + 0.5, p.y(), height) / (2 * pi * tau * tau);
  return film;
}

Eigen::Map<const Eigen::ArrayXd> values_of(const Film& film, int channel = 0) {
  return {film.plane(channel), static_cast<Eigen::Index>(film.plane_size())};
}

/// The greatest error, relative to the greatest value.
double error_of(int width, int height, double tau, const Points& points) {
  const Film fast = estimate(width, height, {DensityKind::gaussian, tau}, points);
  const Film direct = direct_sum(width, height, tau, points);
  return (values_of(fast) - values_of(direct)).abs().maxCoeff() / values_of(direct).maxCoeff();
}

TEST(Density, AgreesWithTheDirectSum) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> x_of(0, 97), y_of(0, 64);
  Points points(60);
  for (Vector2d& point : points) point = {x_of(random), y_of(random)};
  // Below tau = 1 the sum of a sampled Gaussian over the pixels is not 1, and normalising it changes the values: by 2
  // exp(−2π²τ²) per axis, which is 1.3e-4 at 0.7.
  for (const double tau : {0.7, 1.0, 1.5, 2.0, 6.0, 13.0})
    EXPECT_LT(error_of(97, 64, tau, points), tau < 6 ? 1e-3 : 1e-4) << tau;
  // Single points, whose errors do not cancel, at all places within a pixel.
  for (const double tau : {2.0, 4.0})
    for (const double x : {0.0, 0.25, 0.5, 0.75})
      for (const double y : {0.0, 0.5})
        EXPECT_LT(error_of(40, 40, tau, {{20 + x, 20 + y}}), tau < 4 ? 1e-3 : 1.1e-4) << tau << " " << x << " " << y;
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
    const double mean = values_of(film).mean();
    EXPECT_LT((values_of(film) - mean).abs().maxCoeff(), 1e-5 * mean) << spacing;
  }
}

TEST(Density, HistogramCountsInThePixel) {
  const Film film = estimate(4, 3, {DensityKind::histogram, 6}, {{0.5, 0.5}, {3.9, 2.1}, {3.1, 2.9}, {4.0, 3.0}});
  EXPECT_EQ(film.values[0], 1);
  EXPECT_EQ(film.values[2 * 4 + 3], 3);  // The far corner belongs to the last pixel.
  EXPECT_EQ(values_of(film).sum(), 4);
}

TEST(Density, FootprintsAreNeitherLostNorMade) {
  DensityEstimator deposit(40, 30, 2, footprints);
  for (const Vector2d& at : {Vector2d(0, 0), Vector2d(40, 30), Vector2d(20.3, 0.1), Vector2d(7, 29.999)})
    for (const double size : {0.0, 0.1, 2.0, 15.0, 1e30, double{INFINITY}, double{NAN}})
      deposit.add(1, at, Vector2d(size, 3).asDiagonal().toDenseMatrix());
  const Film film = deposit.finish(2);
  EXPECT_NEAR(values_of(film, 1).sum(), 2 * 4 * 7, 1e-7);
  EXPECT_EQ(values_of(film, 0).sum(), 0);
}

TEST(Density, MomentsOfFootprintsAreThoseOfTheEllipse) {
  const Matrix2d turned = Eigen::Rotation2Dd(0.6).toRotationMatrix();
  for (const Vector2d& sizes : {Vector2d(6, 1), Vector2d(3, 3), Vector2d(9, 0)}) {
    const Matrix2d axes = turned * sizes.asDiagonal();
    const Vector2d at(100.3, 99.6);
    DensityEstimator deposit(200, 200, 1, footprints);
    deposit.add(0, at, axes);
    const Film film = deposit.finish(1);
    Vector2d mean(0, 0);
    Matrix2d moments = Matrix2d::Zero();
    for (int y = 0; y < 200; ++y)
      for (int x = 0; x < 200; ++x) {
        const Vector2d from = Vector2d(x + 0.5, y + 0.5) - at;
        mean += film.plane(0)[200 * y + x] * from;
        moments += film.plane(0)[200 * y + x] * from * from.transpose();
      }
    // Of a Gaussian in the plane that ends at 3 standard deviations, the part 1 − 4.5 e^-4.5 / (1 − e^-4.5) is left.
    const double left = 1 - 4.5 * std::exp(-4.5) / (1 - std::exp(-4.5));
    const Matrix2d expected = left * (axes * axes.transpose() + widening * widening * Matrix2d::Identity());
    EXPECT_LT(mean.norm(), 0.05);
    EXPECT_LT((moments - expected).norm(), 0.03 * expected.norm()) << sizes.transpose();
  }
}

TEST(Density, RefusesSumsOfAnotherEstimator) {
  DensityEstimator one(5, 5, 1, {}), other(5, 6, 1, {});
  Archive sums;
  one.copy_sums(sums);
  Archive kept(sums.take());
  EXPECT_THROW(other.copy_sums(kept), std::runtime_error);
}

}  // namespace
}  // namespace tensorray
