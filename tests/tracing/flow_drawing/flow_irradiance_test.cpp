#include "tracing/flow_drawing/flow_irradiance.h"

#include <memory>
#include <numeric>

#include "renderer/light_maps/photon_map.h"
#include "renderer/lights/lights.h"
#include "tests/renderer/shapes.h"
#include "tests/tracing/flow_support.h"

namespace tensorray {
namespace {

FlowIrradiance land(const TensorField& field, const LandingLight& light, const Plate& plate) {
  return flow_irradiance(field, surfaces_of(field), plate, light, {{}, 64, 20000}, {}).value();
}

LandingLight sun(const Vector3d& direction) {
  LandingLight light;
  light.direction = direction.normalized();
  light.flexibilities = {0.1, 0.2, 0.3};
  return light;
}

TensorField bending_field() {
  return cube_field(
      17, [](const Vector3d& p) { return Matrix3d(Vector3d(p.x(), 0.5, 0) * Vector3d::UnitX().transpose()); });
}

/// Irradiance times area, over the whole plate.
double power(const FlowIrradiance& landed, int band) {
  const double* const light = landed.irradiance.plane(band);
  return std::accumulate(light, light + landed.irradiance.plane_size(), 0.0) * landed.plate.pixel_area();
}

LandingLight lamp(const Vector3d& source) {
  LandingLight light = sun({0, 0, -1});
  light.source = source;
  return light;
}

/// The solid angle of the square from −1 to 1 at z = 1, as seen from a point above it.
double solid_angle_of_top(const Vector3d& from) {
  double sum = 0;
  for (const double x : {1 - from.x(), 1 + from.x()})
    for (const double y : {1 - from.y(), 1 + from.y()}) {
      const double z = from.z() - 1;
      sum += std::atan(x * y / (z * std::sqrt(x * x + y * y + z * z)));
    }
  return sum;
}

TEST(FlowIrradianceTest, BentLightKeepsItsPower) {
  const TensorField field = bending_field();
  const auto expect_power = [&](const LandingLight& light, double expected, double tolerance) {
    const FlowIrradiance landed = land(field, light, plate_at(1.5, 40, 64));
    for (int band = 0; band < 2; ++band) EXPECT_NEAR(power(landed, band), expected, tolerance) << band;
  };
  LandingLight light = sun({0.2, 0.1, -1});
  light.passes = 3;
  const double straight = 4 + 2 * (2 * 0.2 + 2 * 0.1);  // Area of the shadow.
  for (const double angle : {0.0, 0.03}) {
    light.angle = angle;
    expect_power(light, straight * -light.direction.z(), 0.01 * straight);
  }
  const Vector3d source(0.3, 0.2, 4);
  expect_power(lamp(source), solid_angle_of_top(source), 0.01 * solid_angle_of_top(source));
}

/// Light is even over each triangle, across which the irradiance changes by percents. Neighbours make up for this, but
/// for a thousandth where quads of two sizes meet.
TEST(FlowIrradianceTest, LightOfAPointFallsWithTheSquareOfTheDistance) {
  const TensorField field = constant_field(Matrix3d::Zero());
  const Vector3d source(0.3, 0.2, 4);
  const FlowIrradiance landed = land(field, lamp(source), plate_at(1.5, 12, 64));
  std::vector<double> errors;
  for (int y = 0; y < landed.irradiance.height; ++y)
    for (int x = 0; x < landed.irradiance.width; ++x) {
      const Vector3d point = landed.plate.to_world({x + 0.5, y + 0.5}), way = point - source;
      const Vector3d on_top = source + 3 / 5.5 * way;  // Where straight light enters the cube.
      const double edge = on_top.head<2>().cwiseAbs().maxCoeff();
      if (std::abs(edge - 1) < 0.05) continue;
      const double expected = edge < 1 ? 5.5 / std::pow(way.norm(), 3) : 0;
      const double error = landed.irradiance.plane(0)[y * landed.irradiance.width + x] - expected;
      EXPECT_LT(std::abs(error), 2e-3 * expected + 1e-9);
      if (edge < 1) errors.push_back(std::abs(error) / expected);
    }
  EXPECT_LT(std::accumulate(errors.begin(), errors.end(), 0.0), 5e-4 * static_cast<double>(errors.size()));
  EXPECT_NEAR(power(landed, 0), solid_angle_of_top(source), 1e-4 * solid_angle_of_top(source));
}

TEST(FlowIrradianceTest, APointWithinTheVolumeIsRefused) {
  EXPECT_THROW(land(constant_field(Matrix3d::Zero()), lamp({0.5, 0, 0}), plate_at(1.5, 12, 64)), std::invalid_argument);
}

/// A plane across the light, behind all of a body within 3 units of (0, 0, −2).
Plate plane_behind(const Vector3d& direction) {
  Plate plate = plate_across(direction, 4);
  plate.center += Vector3d(0, 0, -2);
  plate.size = {6, 6};
  plate.resolution = {64, 64};
  return plate;
}

TriangleMesh square_at(const Vector3d& center, double size) {
  return rectangle_mesh(center, Vector3d::UnitX(), Vector3d::UnitY(), {size, size});
}

/// Light from above through a field that does not bend it, on a body.
FlowIrradiance land_on(const TriangleMesh& body) {
  const TensorField field = constant_field(Matrix3d::Zero());
  Surfaces surfaces = surfaces_of(field);
  surfaces.body = body;
  const LandingLight light = sun({0, 0, -1});
  return flow_irradiance(field, surfaces, plane_behind(light.direction), light, {{}, 192, 40000}, {}).value();
}

/// The irradiance of the first band, on a surface that faces the light, of a point.
double irradiance_at(const FlowIrradiance& landed, const Vector3d& point) {
  const Vector2i at = landed.plate.to_pixel(point).array().floor().cast<int>();
  if (at.minCoeff() < 0 || (at.array() >= landed.plate.resolution.array()).any()) return 0;
  return landed.irradiance.plane(0)[at.y() * landed.irradiance.width + at.x()];
}

/// Of a sun and of a lamp. Means over squares; within a triangle of the map light is even.
TEST(FlowIrradianceTest, ABodyHasTheLightOfAPlateInItsPlace) {
  const TensorField field = bending_field();
  const Vector3d normal = Vector3d(0.3, -0.2, 1).normalized();
  Plate plate = plate_across(-normal, 0);
  plate.center = {0, 0, -2.2};
  plate.size = {8, 8};
  plate.resolution = {64, 64};
  Surfaces surfaces = surfaces_of(field);
  surfaces.body = TriangleMesh{plate.corners(), {{0, 1, 2}, {0, 2, 3}}};
  for (const LandingLight& light : {sun({0.2, 0.1, -1}), lamp({0.5, 0.3, 4})}) {
    Plate behind = plane_behind(light.source ? Vector3d((plate.center - *light.source).normalized()) : light.direction);
    behind.size = {16, 16};
    const FlowIrradiance body = flow_irradiance(field, surfaces, behind, light, {{}, 192, 40000}, {}).value();
    const auto map_of = [&](const FlowIrradiance& from, bool is_body) {
      IrradianceMap result;
      result.plate = from.plate;
      result.source = light.source;
      result.towards = -light.direction;
      result.bands = 1;
      if (is_body) result.body = std::make_shared<SurfaceScene>(std::vector{surface_of(*surfaces.body)});
      for (std::size_t i = 0; i < from.irradiance.plane_size(); ++i)
        result.irradiance.push_back(static_cast<float>(from.irradiance.plane(0)[i]));
      return result;
    };
    const IrradianceMap on_body = map_of(body, true), on_plate = map_of(land(field, light, plate), false);
    for (const double x : {-0.5, 0.0, 0.4}) {
      Eigen::ArrayXd with_body = Eigen::ArrayXd::Zero(1), with_plate = with_body;
      for (int i = 0; i < 400; ++i) {
        const Vector3d point =
            plate.center + (x + (i % 20 - 9.5) / 50) * plate.right + ((i / 20 - 9.5) / 50) * plate.up;
        Eigen::ArrayXd facing = Eigen::ArrayXd::Zero(1);
        add_irradiance(on_body, point, facing);
        const Vector3d to_light = light.source ? Vector3d((*light.source - point).normalized()) : -light.direction;
        with_body += normal.dot(to_light) * facing;
        add_irradiance(on_plate, point, with_plate);
      }
      EXPECT_GT(with_plate[0], light.source ? 4 : 0.1) << x;
      EXPECT_NEAR(with_body[0], with_plate[0], 0.02 * std::max(1.0, with_plate[0])) << x;
    }
  }
}

TEST(FlowIrradianceTest, OnlyTheFirstLayerOfABodyHasLight) {
  // The second square is below the first, half of the third is.
  const FlowIrradiance landed =
      land_on(joined({square_at({0, 0, -2}, 0.5), square_at({0, 0, -2.5}, 0.5), square_at({0.25, 0, -2.25}, 0.5)}));
  EXPECT_NEAR(irradiance_at(landed, {0, 0, 0}), 1, 2e-3);
  EXPECT_NEAR(irradiance_at(landed, {0.35, 0, 0}), 1, 2e-3);
  EXPECT_NEAR(power(landed, 0), 0.75 * 0.5, 0.005);
}

TEST(FlowIrradianceTest, LightThatMeetsABodyBeforeTheVolumeIsNotCounted) {
  // Above the left half of the volume, and below its right half.
  const FlowIrradiance landed = land_on(joined({square_at({-1, 0, 1.5}, 2), square_at({1, 0, -1.5}, 2)}));
  EXPECT_EQ(irradiance_at(landed, {-0.5, 0, 0}), 0);
  EXPECT_NEAR(irradiance_at(landed, {0.5, 0, 0}), 1, 2e-3);
  EXPECT_NEAR(power(landed, 0), 2, 0.02);
}

TEST(FlowIrradianceTest, LightThatGoesAwayFromAPlateDoesNotLand) {
  const TensorField field = constant_field(Matrix3d::Zero());
  EXPECT_FALSE(flow_irradiance(field, surfaces_of(field), plate_at(1.5, 12, 64), sun({0, 0, 1}), {{}, 64, 20000}, {}));
}

}  // namespace
}  // namespace tensorray
