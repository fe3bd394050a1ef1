#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "integrators/seeds/seeds.h"
#include "tests/renderer/support.h"
#include "tests/tracing/support.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A tensor with the trace x + 2 z.
Matrix3d traced(const Vector3d& p) { return Vector3d(p.x(), p.z(), p.z()).asDiagonal(); }

Threshold trace_from(double min, double max = 1e300) { return {Invariant::trace, min, max}; }

TEST(ThresholdSeeds, AreWhereTheTensorIsWanted) {
  const TensorField field = cube_field(9, traced);
  for (const Vector3d& p : threshold_seeds(field, trace_from(1.5, 2), 500, 1)) {
    EXPECT_TRUE(field.contains(p));
    EXPECT_GE(p.x() + 2 * p.z(), 1.5 - 1e-6);
    EXPECT_LE(p.x() + 2 * p.z(), 2 + 1e-6);
  }
}

TEST(ThresholdSeeds, AreEvenlySpread) {
  // The seeds fill the half of a cube with x + 2 z > 0. The parts on either side of y = 0 and of x + 2 z = 1 / 2 have
  // seeds in proportion to their volumes. The tolerance is one standard deviation of independent points: 32 at a half
  // of 4096.
  const TensorField field = cube_field(9, traced);
  const std::vector<Vector3d> seeds = threshold_seeds(field, trace_from(0), 4096, 7);
  int right = 0, inner = 0;
  for (const Vector3d& p : seeds) {
    right += p.y() > 0;
    inner += p.x() + 2 * p.z() < 0.5;
  }
  EXPECT_NEAR(right, 2048, 32);
  EXPECT_NEAR(inner, 4096 / 4, 32);  // In the cube, the probability density of x + 2 z is 1/4 up to 1.
}

TEST(ThresholdSeeds, StayInATurnedField) {
  const Eigen::Affine3d placement(Eigen::Translation3d(3, -1, 2) *
                                  Eigen::AngleAxisd(0.6, Vector3d(1, 2, 3).normalized()));
  const TensorField field = cube_field(9, traced, placement);
  for (const Vector3d& p : threshold_seeds(field, trace_from(-1e300), 300, 1)) EXPECT_TRUE(field.contains(p));
}

TEST(ThresholdSeeds, AreTheSameAgainAndDependOnTheSeed) {
  const TensorField field = cube_field(9, traced);
  const auto seeds = threshold_seeds(field, trace_from(1), 200, 3);
  ASSERT_EQ(seeds.size(), 200u);
  EXPECT_EQ(seeds, threshold_seeds(field, trace_from(1), 200, 3));
  EXPECT_NE(seeds, threshold_seeds(field, trace_from(1), 200, 4));
  const auto fewer = threshold_seeds(field, trace_from(1), 20, 3);
  EXPECT_EQ(fewer, std::vector<Vector3d>(seeds.begin(), seeds.begin() + 20));
}

TEST(ThresholdSeeds, SaysWhatValuesThereAreWhenNoneIsWanted) {
  const TensorField field = constant_field(2 * Matrix3d::Identity());
  EXPECT_EQ(message([&] { threshold_seeds(field, trace_from(7, 8), 10, 1); }),
            "only 0 of 10 seeds found where the threshold wants values from 7 to 8: in the box they are from 6 to 6; "
            "widen the threshold, or ask for fewer seeds");
  EXPECT_THROW(threshold_seeds(field, trace_from(0), 0, 1), std::invalid_argument);
  EXPECT_THROW(threshold_seeds(field, trace_from(2, 1), 1, 1), std::invalid_argument);
}

}  // namespace
}  // namespace tensorray
