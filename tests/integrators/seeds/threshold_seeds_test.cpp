#include "integrators/seeds/threshold_seeds.h"

#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/renderer/support.h"
#include "tests/tracing/support.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::AlignedBox3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A tensor with the trace x + 2 z.
Matrix3d traced(const Vector3d& p) { return Vector3d(p.x(), p.z(), p.z()).asDiagonal(); }

Threshold trace_from(double least, double greatest = 1e300) {
  Threshold threshold;
  threshold.value = [](const Matrix3d& T) { return T.trace(); };
  threshold.least = least;
  threshold.greatest = greatest;
  return threshold;
}

const AlignedBox3d everything(Vector3d::Constant(-100), Vector3d::Constant(100));

TEST(ThresholdSeeds, AreWhereTheTensorIsWanted) {
  const TensorField field = cube_field(9, traced);
  for (const Vector3d& p : threshold_seeds(field, everything, trace_from(1.5, 2), 500, 1)) {
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
  const std::vector<Vector3d> seeds = threshold_seeds(field, everything, trace_from(0), 4096, 7);
  int right = 0, inner = 0;
  for (const Vector3d& p : seeds) {
    right += p.y() > 0;
    inner += p.x() + 2 * p.z() < 0.5;
  }
  EXPECT_NEAR(right, 2048, 32);
  EXPECT_NEAR(inner, 4096 / 4, 32);  // In the cube, the probability density of x + 2 z is 1/4 up to 1.
}

TEST(ThresholdSeeds, StayInTheBoxOfATurnedField) {
  const Eigen::Affine3d placement(Eigen::Translation3d(3, -1, 2) *
                                  Eigen::AngleAxisd(0.6, Vector3d(1, 2, 3).normalized()));
  const TensorField field = cube_field(9, traced, placement);
  const AlignedBox3d box(Vector3d(3, -1, 1.8), Vector3d(4, 5, 2.4));
  for (const Vector3d& p : threshold_seeds(field, box, trace_from(-1e300), 300, 1)) {
    EXPECT_TRUE(box.contains(p));
    EXPECT_TRUE(field.contains(p));
  }
  const AlignedBox3d slice(Vector3d(2, -3, 2), Vector3d(4, 3, 2));
  for (const Vector3d& p : threshold_seeds(field, slice, trace_from(-1e300), 50, 1)) EXPECT_NEAR(p.z(), 2, 1e-10);
}

TEST(ThresholdSeeds, AreTheSameAgainAndDependOnTheSeed) {
  const TensorField field = cube_field(9, traced);
  const auto seeds = threshold_seeds(field, everything, trace_from(1), 200, 3);
  ASSERT_EQ(seeds.size(), 200u);
  EXPECT_EQ(seeds, threshold_seeds(field, everything, trace_from(1), 200, 3));
  EXPECT_NE(seeds, threshold_seeds(field, everything, trace_from(1), 200, 4));
  const auto fewer = threshold_seeds(field, everything, trace_from(1), 20, 3);
  EXPECT_EQ(fewer, std::vector<Vector3d>(seeds.begin(), seeds.begin() + 20));
}

TEST(ThresholdSeeds, SaysWhatValuesThereAreWhenNoneIsWanted) {
  const TensorField field = constant_field(2 * Matrix3d::Identity());
  EXPECT_EQ(message([&] { threshold_seeds(field, everything, trace_from(7, 8), 10, 1); }),
            "only 0 of 10 seeds found where the threshold wants values from 7 to 8: in the box they are from 6 to 6; "
            "widen the threshold, or ask for fewer seeds");
  Threshold never = trace_from(0);
  never.value = [](const Matrix3d&) { return std::nan(""); };
  EXPECT_NE(message([&] { threshold_seeds(field, everything, never, 10, 1); }).find("none is a number"),
            std::string::npos);
  EXPECT_THROW(threshold_seeds(field, everything, trace_from(0), 0, 1), std::invalid_argument);
  EXPECT_THROW(threshold_seeds(field, everything, trace_from(2, 1), 1, 1), std::invalid_argument);
  EXPECT_THROW(threshold_seeds(field, AlignedBox3d(), trace_from(0), 1, 1), std::invalid_argument);
  const AlignedBox3d elsewhere(Vector3d(5, 5, 5), Vector3d(6, 6, 6));
  EXPECT_THROW(threshold_seeds(field, elsewhere, trace_from(0), 1, 1), std::invalid_argument);
}

}  // namespace
}  // namespace tensorray
