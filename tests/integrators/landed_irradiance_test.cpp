#include "integrators/flow/landed_irradiance.h"

#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/integrators/support.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector3d;

Plate floor_plate(double size) {
  Plate plate;
  plate.center = {0, 0, -1.5};
  plate.size = {size, size};
  plate.resolution = {64, 64};
  return plate;
}

LandedIrradiance land(const TensorField& field, const DistantLight& light, const Plate& plate) {
  const auto landed = landed_irradiance(field, surfaces_of(field), plate, light, {}, 64, 20000, {});
  if (!landed) throw std::runtime_error("no light landed");
  return *landed;
}

DistantLight sun(const Vector3d& direction) {
  DistantLight light;
  light.direction = direction.normalized();
  light.flexibilities = {0.1, 0.2, 0.3};
  return light;
}

/// Irradiance times area, over the whole plate.
double power(const LandedIrradiance& landed, int band) {
  double sum = 0;
  for (std::size_t i = 0; i < landed.irradiance.plane_size(); ++i) sum += landed.irradiance.plane(band)[i];
  return sum * landed.plate.pixel_area();
}

TEST(LandedIrradianceTest, StraightLightFillsTheShadowOfTheVolume) {
  const TensorField field = constant_field(Matrix3d::Zero());
  const Vector3d direction(0.5, 0, -1);
  const LandedIrradiance landed = land(field, sun(direction), floor_plate(12));
  // The shadow is the hull of the bottom and the top of the cube, moved along the light.
  const auto irradiance = [&](double x, double y) {
    const Eigen::Vector2i at = landed.plate.to_pixel({x, y, -1.5}).array().floor().cast<int>();
    if (at.minCoeff() < 0 || (at.array() >= landed.plate.resolution.array()).any()) return 0.0;
    return landed.irradiance.plane(1)[at.y() * landed.irradiance.width + at.x()];
  };
  EXPECT_NEAR(irradiance(0.7, 0), -direction.normalized().z(), 2e-3);
  EXPECT_NEAR(irradiance(-0.6, 0.9), -direction.normalized().z(), 2e-3);
  EXPECT_EQ(irradiance(-0.85, 0), 0);
  EXPECT_EQ(irradiance(0.7, 1.1), 0);
  EXPECT_NEAR(power(landed, 0), 2 * 3 * -direction.normalized().z(), 0.01);
}

TEST(LandedIrradianceTest, BentLightKeepsItsPower) {
  const TensorField field = cube_field(17, [](const Vector3d& p) {
    Matrix3d T = Matrix3d::Zero();
    T(0, 0) = p.x();
    T(1, 0) = 0.5;
    return T;
  });
  DistantLight light = sun({0.2, 0.1, -1});
  const double straight = 4 + 2 * (2 * 0.2 + 2 * 0.1);  // Area of the shadow.
  for (const double angle : {0.0, 0.03}) {
    light.angle = angle;
    light.passes = 3;
    const LandedIrradiance landed = land(field, light, floor_plate(40));
    for (int band = 0; band < 2; ++band)
      EXPECT_NEAR(power(landed, band), straight * -light.direction.z(), 0.01 * straight) << band;
  }
}

TEST(LandedIrradianceTest, IsTheSameOnAnyNumberOfThreads) {
  const TensorField field = cube_field(17, linear_tensor);
  std::vector<double> first;
  for (const std::size_t threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const LandedIrradiance landed = land(field, sun({0.2, 0.1, -1}), floor_plate(8));
    if (first.empty()) first = landed.irradiance.values;
    EXPECT_EQ(first, landed.irradiance.values) << threads;
  }
}

TEST(LandedIrradianceTest, LightThatGoesAwayFromAPlateDoesNotLand) {
  const TensorField field = constant_field(Matrix3d::Zero());
  EXPECT_FALSE(landed_irradiance(field, surfaces_of(field), floor_plate(12), sun({0, 0, 1}), {}, 64, 20000, {}));
}

}  // namespace
}  // namespace tensorray
