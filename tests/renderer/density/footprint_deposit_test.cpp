// Tests that photons are spread over ellipses.

#include "renderer/density/footprint_deposit.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double widening = 0.4;  // Pixels; see FootprintDeposit::add.

double sum_of(const Film& film, int channel) {
  double sum = 0;
  for (std::size_t i = 0; i < film.plane_size(); ++i) sum += film.plane(channel)[i];
  return sum;
}

TEST(FootprintDeposit, PhotonsAreNeitherLostNorMade) {
  FootprintDeposit deposit(40, 30, 2);
  const double huge = 1e30, infinite = std::numeric_limits<double>::infinity();
  for (const Vector2d& at : {Vector2d(0, 0), Vector2d(40, 30), Vector2d(20.3, 0.1), Vector2d(7, 29.999)})
    for (const double size : {0.0, 0.1, 2.0, 15.0, huge, infinite, std::nan("")})
      deposit.add(1, at, Vector2d(size, 3).asDiagonal().toDenseMatrix());
  const Film film = deposit.finish(2);
  EXPECT_NEAR(sum_of(film, 1), 2 * 4 * 7, 1e-7);
  EXPECT_EQ(sum_of(film, 0), 0);
}

TEST(FootprintDeposit, MomentsAreThoseOfTheEllipse) {
  const Matrix2d turned = Eigen::Rotation2Dd(0.6).toRotationMatrix();
  for (const Vector2d& sizes : {Vector2d(6, 1), Vector2d(3, 3), Vector2d(9, 0)}) {
    const Matrix2d axes = turned * sizes.asDiagonal();
    const Vector2d at(100.3, 99.6);
    FootprintDeposit deposit(200, 200, 1);
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

TEST(FootprintDeposit, ALatticeOfPhotonsIsEvenUpToTheEdges) {
  constexpr int size = 64;
  constexpr double spacing = 2;
  FootprintDeposit deposit(size, size, 1);
  for (double y = spacing / 2; y < size; y += spacing)
    for (double x = spacing / 2; x < size; x += spacing) deposit.add(0, {x, y}, 0.7 * spacing * Matrix2d::Identity());
  // The first harmonic of the lattice, less that of the cut-off.
  for (const double value : deposit.finish(spacing * spacing).values) EXPECT_NEAR(value, 1, 0.01);
}

TEST(FootprintDeposit, ColoursAreFactorsAndTheOrderDoesNotMatter) {
  const std::vector<Eigen::Vector3d> colors{{1, 0.5, -0.25}, {0, 2, 1}};
  const auto add = [](FootprintDeposit& deposit, int i) {
    deposit.add(i % 2, {16 + 12 * std::sin(i), 16 + 12 * std::cos(3 * i)}, Vector2d(1 + i % 3, 0.5).asDiagonal());
  };
  FootprintDeposit serial(32, 32, 2, colors), parallel(32, 32, 2, colors);
  for (int i = 0; i < 200; ++i) add(serial, i);
  tbb::parallel_for(0, 200, [&](int i) { add(parallel, 199 - i); });
  const Film film = serial.finish(1);
  EXPECT_EQ(film.values, parallel.finish(1).values);
  ASSERT_EQ(film.channels, 3);
  EXPECT_NEAR(sum_of(film, 0), 100, 1e-6);
  EXPECT_NEAR(sum_of(film, 1), 250, 1e-6);
  EXPECT_NEAR(sum_of(film, 2), 75, 1e-6);
}

TEST(FootprintDeposit, SumsOfPartsCanBeAdded) {
  FootprintDeposit all(32, 20, 2), joined(32, 20, 2);
  for (int part = 0; part < 3; ++part) {
    FootprintDeposit some(32, 20, 2);
    for (int i = part; i < 200; i += 3)
      for (FootprintDeposit* each : {&all, &some})
        each->add(i % 2, {16 + 12 * std::sin(i), 10 + 9 * std::cos(3 * i)}, Vector2d(1 + i % 3, 0.5).asDiagonal());
    Archive to;
    some.copy_sums(to);
    const std::string sums = to.take();
    Archive from(sums), cut(std::string_view(sums).substr(8));
    joined.copy_sums(from);
    from.finish();
    EXPECT_THROW(joined.copy_sums(cut), DamagedArchive);
  }
  EXPECT_EQ(all.finish(0.3).values, joined.finish(0.3).values);
}

TEST(FootprintDeposit, WrongSizesAreRefused) {
  EXPECT_THROW(FootprintDeposit(0, 5, 1), std::invalid_argument);
  EXPECT_THROW(FootprintDeposit(5, 5, 0), std::invalid_argument);
  EXPECT_THROW(FootprintDeposit(5, 5, 2, {{1, 1, 1}}), std::invalid_argument);
}

}  // namespace
}  // namespace tensorray
