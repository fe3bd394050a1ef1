#include "renderer/lights/beam.h"

#include <array>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr BeamPattern all_patterns[] = {BeamPattern::grid, BeamPattern::stratified, BeamPattern::sobol,
                                        BeamPattern::random};

std::vector<Vector3d> cube_corners() {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) corners.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
  return corners;
}

TEST(Beam, SilhouetteOfACube) {
  EXPECT_NEAR(area(silhouette_beam(cube_corners(), {0, 0, -1}, Vector3d::UnitY()).aperture), 4, 1e-12);
  // Along a diagonal it is a regular hexagon. Its area is 2 √3 times half the area of a face.
  const Beam hexagon = silhouette_beam(cube_corners(), {1, 1, 1}, Vector3d::UnitZ());
  EXPECT_EQ(hexagon.aperture.size(), 6u);
  EXPECT_NEAR(area(hexagon.aperture), 4 * std::sqrt(3.0), 1e-12);
  for (const Vector3d& corner : cube_corners()) EXPECT_GT((corner - hexagon.center).dot(hexagon.direction), 0);
  EXPECT_NEAR(hexagon.direction.norm(), 1, 1e-15);
  EXPECT_LT((hexagon.right.cross(hexagon.up) + hexagon.direction).norm(), 1e-14);
}

TEST(Beam, PositionsFillTheAperture) {
  const Beam beam = silhouette_beam(cube_corners(), {1, 2, -3}, Vector3d::UnitZ());
  for (const BeamPattern pattern : all_patterns) {
    const BeamSampler sampler(beam, pattern, 20000, 7);
    std::uint64_t inside = 0;
    Emission emission;
    Vector3d mean = Vector3d::Zero();
    for (std::uint64_t i = 0; i < sampler.candidates(); ++i) {
      if (!sampler.sample(i, emission)) continue;
      ++inside;
      mean += emission.origin;
      EXPECT_NEAR((emission.origin - beam.center).dot(beam.direction), 0, 1e-12);
      EXPECT_GE(emission.stratum, 0);
      EXPECT_LT(emission.stratum, 1);
    }
    // The count of random positions has the standard deviation sqrt(count); allow 5 of them. Other patterns deviate far
    // less.
    EXPECT_NEAR(static_cast<double>(inside), 20000, 5 * std::sqrt(20000.0));
    EXPECT_NEAR(static_cast<double>(inside) * sampler.area_per_candidate(), area(beam.aperture),
                0.04 * area(beam.aperture));
    EXPECT_LT((mean / static_cast<double>(inside) - beam.center).norm(), 0.05);  // The silhouette is symmetric.
  }
}

TEST(Beam, GridPositionsAreCellCentres) {
  const Beam beam = silhouette_beam(cube_corners(), {0, 0, -1}, Vector3d::UnitY());
  const BeamSampler sampler(beam, BeamPattern::grid, 16, 0);
  ASSERT_EQ(sampler.candidates(), 16u);
  Emission emission;
  ASSERT_TRUE(sampler.sample(5, emission));
  EXPECT_LT((emission.origin.head<2>() - Eigen::Vector2d(-0.25, -0.25)).norm(), 1e-12);
  EXPECT_EQ(emission.across, Eigen::Vector2d(0.375, 0.375));
}

TEST(Beam, StrataSpreadOverThePositions) {
  // In each part of the beam, an eighth of the positions of a lattice has its stratum in each of 8 ranges.
  const Beam beam = silhouette_beam(cube_corners(), {0, 0, -1}, Vector3d::UnitY());
  for (const BeamPattern pattern : {BeamPattern::stratified, BeamPattern::sobol}) {
    const BeamSampler sampler(beam, pattern, 4096, 3);
    std::array<std::array<int, 8>, 16> counts{};
    Emission emission;
    for (std::uint64_t i = 0; i < sampler.candidates(); ++i) {
      ASSERT_TRUE(sampler.sample(i, emission));
      const int x = static_cast<int>((emission.origin.x() + 1) * 2),
                y = static_cast<int>((emission.origin.y() + 1) * 2);
      ++counts[4 * y + x][static_cast<int>(emission.stratum * 8)];
    }
    for (const auto& part : counts)
      // Independent samples would give a standard deviation of 5.3.
      for (const int count : part) EXPECT_NEAR(count, 32, 8);
  }
}

}  // namespace
}  // namespace tensorray
