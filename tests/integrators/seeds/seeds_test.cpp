#include "integrators/seeds/seeds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// A slanted view of a cube: its aperture is a hexagon.
Beam hexagonal_beam() {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) corners.emplace_back(i & 1, (i >> 1) & 1, (i >> 2) & 1);
  return silhouette_beam(corners, Vector3d(0.4, 0.7, -1), Vector3d::UnitY());
}

void expect_in_aperture(const Beam& beam, const std::vector<Vector3d>& seeds) {
  for (const Vector3d& seed : seeds) {
    const Vector3d p = seed - beam.center;
    EXPECT_NEAR(p.dot(beam.direction), 0, 1e-12);
    const Eigen::Vector2d at(p.dot(beam.right), p.dot(beam.up));
    for (std::size_t i = 0; i < beam.aperture.size(); ++i) {
      const Eigen::Vector2d edge = beam.aperture[(i + 1) % beam.aperture.size()] - beam.aperture[i];
      const Eigen::Vector2d to = at - beam.aperture[i];
      EXPECT_GE(edge.x() * to.y() - edge.y() * to.x(), -1e-9);
    }
  }
}

double min_distance(const std::vector<Vector3d>& seeds) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < seeds.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) least = std::min(least, (seeds[i] - seeds[j]).norm());
  return least;
}

TEST(Seeds, AGridFillsTheAperture) {
  const Beam beam = hexagonal_beam();
  const std::vector<Vector3d> seeds = grid_seeds(beam, 400);
  EXPECT_NEAR(double(seeds.size()), 400, 40);  // There may be one row of 20 more or less at each of two edges.
  expect_in_aperture(beam, seeds);
  // Cells are nearly squares of area / 400, and their edges differ by at most half a cell in 20.
  EXPECT_NEAR(min_distance(seeds), std::sqrt(area(beam.aperture) / 400), 0.1 * std::sqrt(area(beam.aperture) / 400));
}

TEST(Seeds, PoissonDisksAreApartAndFillTheAperture) {
  const Beam beam = hexagonal_beam();
  for (const std::uint64_t count : {1u, 2u, 3u, 7u, 600u}) {
    const std::vector<Vector3d> seeds = poisson_disk_seeds(beam, count, 5);
    ASSERT_EQ(seeds.size(), count);
    expect_in_aperture(beam, seeds);
    EXPECT_GE(min_distance(seeds), 0.75 * std::sqrt(area(beam.aperture) / double(count)));
  }
  const std::vector<Vector3d> seeds = poisson_disk_seeds(beam, 600, 5);
  EXPECT_EQ(seeds, poisson_disk_seeds(beam, 600, 5));
  EXPECT_NE(seeds, poisson_disk_seeds(beam, 600, 6));
  // Each half of the aperture has half of the seeds. Even a random choice would differ by only 12, which is √(600 / 4).
  const auto right = std::count_if(seeds.begin(), seeds.end(),
                                   [&](const Vector3d& seed) { return (seed - beam.center).dot(beam.right) > 0; });
  EXPECT_NEAR(double(right), 300, 36);
}

TEST(Seeds, PoissonDisksFillANarrowApertureToo) {
  Beam beam;
  beam.aperture = {{-1, -1e-4}, {1, -1e-4}, {1, 1e-4}, {-1, 1e-4}};
  EXPECT_EQ(poisson_disk_seeds(beam, 50, 1).size(), 50u);
  EXPECT_EQ(poisson_disk_seeds(beam, 20000, 1).size(), 20000u);
}

TEST(Seeds, ALineHasItsEnds) {
  const Vector3d from(1, 2, 3), to(3, 2, 1);
  const std::vector<Vector3d> seeds = line_seeds(from, to, 5);
  ASSERT_EQ(seeds.size(), 5u);
  EXPECT_EQ(seeds.front(), from);
  EXPECT_EQ(seeds.back(), to);
  for (int i = 0; i < 5; ++i) EXPECT_LT((seeds[i] - Vector3d(1 + 0.5 * i, 2, 3 - 0.5 * i)).norm(), 1e-12);
  EXPECT_EQ(line_seeds(from, to, 1), std::vector<Vector3d>{Vector3d(2, 2, 2)});
}

TEST(Seeds, ASphereIsFilledEvenly) {
  const Vector3d center(1, -2, 3);
  const std::vector<Vector3d> seeds = sphere_seeds(center, 2, 4096, 3);
  Vector3d mean = Vector3d::Zero();
  int inner = 0;
  for (const Vector3d& seed : seeds) {
    EXPECT_LE((seed - center).norm(), 2 * (1 + 1e-12));
    mean += (seed - center) / 4096;
    inner += (seed - center).norm() < 1;
  }
  // An eighth of the volume is within half the radius, and an elementary interval of the sequence.
  EXPECT_EQ(inner, 512);
  EXPECT_LT(mean.norm(), 0.01);  // Independent points: 2 √(3/5) / √4096 = 0.024.
}

}  // namespace
}  // namespace tensorray
