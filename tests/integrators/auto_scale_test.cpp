#include "integrators/probes/auto_scale.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/integrators/support.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector3d;

AutoScale scale_of(const TensorField& field, const Vector3d& direction = {0, 0, -1}) {
  return choose_scale(field, Geometry(surfaces_of(field)),
                      silhouette_beam(field.corners(), direction, Vector3d::UnitY()), Progress());
}

TEST(AutoScale, TurnsTheMedianRayByTheWantedAngle) {
  for (const double size : {1e-6, 1.0, 1e6}) {
    const TensorField field = cube_field(9, [&](const Vector3d& p) { return Matrix3d(size * linear_tensor(p)); });
    const AutoScale chosen = scale_of(field);
    EXPECT_NEAR(chosen.median_turn, 0.15, 1e-3);
    EXPECT_GT(chosen.bent_fraction, 0.99);
    // The scale cancels the units of the field.
    EXPECT_NEAR(chosen.scale * size / scale_of(cube_field(9, linear_tensor)).scale, 1, 1e-4);
  }
}

TEST(AutoScale, AgreesWithTheClosedFormOfARotation) {
  Matrix3d T = Matrix3d::Zero();  // About x, with rate 3: light along −z turns by 3 s k times its path's length.
  T(1, 2) = -3;
  T(2, 1) = 3;
  const AutoScale chosen = scale_of(constant_field(T));
  // Most rays cross the whole volume: along an arc of angle 0.15 that spans a depth of 2.
  const double length = 2 * 0.15 / std::sin(0.15);
  EXPECT_NEAR(chosen.scale, 0.15 / (0.2 * 3 * length), 2e-3 * chosen.scale);
}

TEST(AutoScale, FieldsThatTurnNoLightKeepTheirScale) {
  for (const double c : {0.0, 5.0}) {
    const AutoScale chosen = scale_of(constant_field(c * Matrix3d::Identity()));
    EXPECT_EQ(chosen.scale, 1);
    EXPECT_EQ(chosen.median_turn, 0);
  }
  // An eigenvector as direction.
  EXPECT_EQ(scale_of(constant_field(Vector3d(1, 2, 3).asDiagonal().toDenseMatrix())).median_turn, 0);
}

TEST(AutoScale, StopsWhenCancelled) {
  const TensorField field = cube_field(9, linear_tensor);
  Progress progress;
  progress.cancelled = true;
  const Beam beam = silhouette_beam(field.corners(), {0, 0, -1}, Vector3d::UnitY());
  EXPECT_THROW(choose_scale(field, Geometry(surfaces_of(field)), beam, progress), Cancelled);
}

TEST(AutoScale, RaysThatMeetNothingDoNotCount) {
  // A quarter of the beam's cross section is bent.
  const TensorField field = cube_field(33, [](const Vector3d& p) {
    return Matrix3d(p.x() > 0 && p.y() > 0 ? linear_tensor(p) : Matrix3d::Zero().eval());
  });
  const AutoScale chosen = scale_of(field);
  EXPECT_NEAR(chosen.median_turn, 0.15, 2e-3);
  EXPECT_NEAR(chosen.bent_fraction, 0.25, 0.05);
}

}  // namespace
}  // namespace tensorray
