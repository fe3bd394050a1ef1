
#include <cmath>

#include <gtest/gtest.h>

#include "integrators/scene/field_region.h"
#include "renderer/lights/lights.h"
#include "renderer/sampling/random.h"
#include "tests/tracing/support.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int bands = 32;

/// Ways of every fourth band, as a camera's ray has them.
std::vector<BentRay> ways_of(const Vector3d& position, const Vector3d& direction, double tolerance, int step = 4) {
  std::vector<BentRay> ways;
  for (int band = 1; band < bands; band += step) {
    BentRay way;
    way.band = band;
    way.position = position;
    way.direction = direction.normalized();
    way.tolerance = tolerance;
    ways.push_back(way);
  }
  return ways;
}

/// Ends that are polynomials of degree 2 in the band, seen from a distance of about 2.
std::vector<BentRay> parabolic_ends() {
  std::vector<BentRay> ways = ways_of({0, 0, 0}, {0, 0, 1}, 1e-6);
  for (BentRay& way : ways) {
    const double x = way.band / 32.0;
    way.position = {x, 1 - x * x, 2};
    way.direction = Vector3d(0, 0, 1);
    way.jacobian = std::exp(0.3 * x - x * x);
    way.arrives = true;
  }
  return ways;
}

TEST(BandInterpolationTest, TheCheckSeesWhatIsNotPredictable) {
  const BandGroup group = interpolation_groups(ways_of({0, 0, 0}, {0, 0, 1}, 1e-6))[0];
  for (const int what : {0, 1, 2}) {
    std::vector<BentRay> ways = parabolic_ends();
    BentRay& check = ways[group.check];
    if (what == 0) check.position.x() += 1e-5;  // The tolerance is 1e-6 at a distance of 2.
    if (what == 1) check.direction = Vector3d(1e-5, 0, 1).normalized();
    if (what == 2) check.jacobian *= 1.02;
    EXPECT_FALSE(is_predictable(group, ways, {0, 0, 0})) << what;
  }
}

/// A smooth field that turns light of the last band by about 0.2 radians.
class InterpolatedRegion : public testing::Test {
 protected:
  static FieldViewSettings settings(double strength, Conserve conserve = Conserve::power) {
    FieldViewSettings view;
    view.conserve = conserve;
    view.flexibility = [strength](int band, double place) { return strength * (band + place) / bands; };
    return view;
  }

  static std::vector<BentRay> random_ways(double tolerance) {
    std::vector<BentRay> ways;
    for (std::uint64_t i = 0; i < 40; ++i) {
      const auto number = [i](int dimension) { return random_uniform(8, i, dimension) - 0.5; };
      const Vector3d from(3, number(0), number(1)), to(0, number(2), number(3));
      const std::vector<BentRay> more = ways_of(from, to - from, tolerance);
      ways.insert(ways.end(), more.begin(), more.end());
    }
    return ways;
  }

  static std::uint64_t followed(const FieldRegion& region) {
    std::uint64_t sum = 0;
    for (int end = 0; end < ray_end_count; ++end) sum += region.ways(static_cast<RayEnd>(end));
    return sum;
  }

  const TensorField field_ = cube_field(33, [](const Vector3d& p) {
    Matrix3d T;
    T << 0.4 * p.x(), 0.1, -p.x(), 0, 0.5, -0.8 * p.y(), 0.5 - p.x(), -p.y(), -0.3;
    return T;
  });
  const Geometry geometry_{surfaces_of(field_)};
};

TEST_F(InterpolatedRegion, IsWithinTheTolerance) {
  constexpr double tolerance = 2e-4;
  for (const Conserve conserve : {Conserve::power, Conserve::radiance}) {
    const FieldRegion region(field_, geometry_, settings(0.2, conserve)),
        exact(field_, geometry_, settings(0.2, conserve));
    std::vector<BentRay> ways = random_ways(tolerance), truth = random_ways(0);
    const std::vector<BentRay> starts = truth;
    region.trace_radiance(ways);
    exact.trace_radiance(truth);
    for (std::size_t i = 0; i < ways.size(); ++i) {
      ASSERT_TRUE(truth[i].arrives && ways[i].arrives);
      const double distance = (truth[i].position - starts[i].position).norm();
      EXPECT_LT((ways[i].position - truth[i].position).norm(), tolerance * distance);
      EXPECT_LT((ways[i].direction - truth[i].direction).norm(), tolerance);
      EXPECT_NEAR(ways[i].radiance_scale, truth[i].radiance_scale, 0.01 * truth[i].radiance_scale);
      EXPECT_NEAR(ways[i].jacobian, truth[i].jacobian, 0.01 * truth[i].jacobian);
    }
    EXPECT_EQ(followed(exact), truth.size());
    EXPECT_LT(followed(region), 0.7 * static_cast<double>(truth.size()));
    EXPECT_GE(followed(region), truth.size() / 2);
  }
}

/// With a tolerance that no interpolation reaches, or an obstacle that only some bands might meet, all bands are
/// followed, with the same results as alone.
TEST_F(InterpolatedRegion, FollowsAllBandsWhereItMust) {
  Surfaces surfaces = surfaces_of(field_);
  surfaces.obstacles = {rectangle_mesh({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0.1, 0.1})};
  const Geometry with_obstacle(std::move(surfaces));
  for (const bool has_obstacle : {false, true}) {
    const Geometry& geometry = has_obstacle ? with_obstacle : geometry_;
    const FieldRegion region(field_, geometry, settings(0.2)), exact(field_, geometry, settings(0.2));
    std::vector<BentRay> ways = random_ways(has_obstacle ? 1e-3 : 1e-12), truth = random_ways(0);
    region.trace_radiance(ways);
    exact.trace_radiance(truth);
    for (std::size_t i = 0; i < ways.size(); ++i) {
      EXPECT_EQ(ways[i].position, truth[i].position);
      EXPECT_EQ(ways[i].direction, truth[i].direction);
      EXPECT_EQ(ways[i].radiance_scale, truth[i].radiance_scale);
    }
    EXPECT_EQ(followed(region), truth.size());
  }
}

}  // namespace
}  // namespace tensorray
