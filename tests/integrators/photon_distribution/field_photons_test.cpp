// Photons of a path tracer's lights through a tensor field.

#include <cmath>

#include <gtest/gtest.h>

#include "base/constants.h"
#include "integrators/scene/field_region.h"
#include "renderer/light_maps/photon_tracer.h"
#include "renderer/sampling/random.h"
#include "tests/tracing/support.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double height = -0.3;  // Of a floor within the volume.
constexpr double flexibility = 0.6;
const Vector3d along = Vector3d(0.15, -0.1, -1).normalized();

/// A smooth field that focuses and turns light.
TensorField lens_field() {
  return cube_field(17, [](const Vector3d& p) {
    Matrix3d T;
    T << 0.4 * p.x(), 0.1, -p.x(), 0, 0.5, -0.8 * p.y(), 0.5 - p.x(), -p.y(), -0.3;
    return T;
  });
}

TriangleMesh floor_mesh() { return rectangle_mesh({0, 0, height}, {1, 0, 0}, {0, 1, 0}, {6, 6}); }

Geometry geometry_with_floor(const TensorField& field) {
  Surfaces surfaces = surfaces_of(field);
  surfaces.obstacles = {floor_mesh()};
  return Geometry(std::move(surfaces));
}

SurfaceScene floor_scene() {
  std::vector<ShadedSurface> surfaces(1);
  surfaces[0].shape = floor_mesh();
  return SurfaceScene(std::move(surfaces));
}

const PointLight point_within{{0.1, -0.2, 0.4}, {1}};

/// The power on the floor's squares of 0.25 × 0.25 about the origin, by photons.
std::vector<double> photons_on_floor(const TensorField& field, double strength, Conserve conserve,
                                     const Light& light = DirectionalLight{along, {1}}) {
  const Geometry geometry = geometry_with_floor(field);
  FieldViewSettings view;
  view.conserve = conserve;
  view.flexibility = [strength](int, double) { return strength; };
  const FieldRegion region(field, geometry, view);
  PhotonTracerSettings settings;
  settings.per_pass = 60000;
  settings.radius = 0.01;
  settings.serves = [](int, std::uint32_t) { return true; };
  const PhotonMaps photons = trace_photons(region, field.corners(), floor_scene(), {light}, settings, {});
  std::vector<double> power(64);
  for (const Photon& photon : photons.passes[0].photons()) {
    const Eigen::Array2i square = ((photon.position.head<2>().array() + 1) / 0.25f).floor().cast<int>();
    if ((square >= 0).all() && (square < 8).all())
      power[static_cast<std::size_t>(8 * square.y() + square.x())] += photon.power;
  }
  return power;
}

/// Rays of the sun, from random positions of a square above the volume.
/// @param power  Of each of them.
RayBatch sun_rays(double& power) {
  constexpr int count = 120000;
  constexpr double side = 2.6;
  RayBatch rays;
  for (int i = 0; i < count; ++i) {
    const Vector3d at(side * (random_uniform(1, i, 0) - 0.5), side * (random_uniform(1, i, 1) - 0.5), 1);
    rays.add(at - 0.5 * along, along, flexibility);
  }
  power = side * side * std::abs(along.z()) / count;
  return rays;
}

/// Rays of the point, the lower half of them.
RayBatch point_rays(double& power) {
  constexpr int count = 120000;
  RayBatch rays;
  for (int i = 0; i < count; ++i) {
    const double z = -random_uniform(2, i, 0), turn = 2 * pi * random_uniform(2, i, 1), across = std::sqrt(1 - z * z);
    rays.add(point_within.position, {across * std::cos(turn), across * std::sin(turn), z}, flexibility);
  }
  power = 2 * pi / count;
  return rays;
}

/// The same by rays one by one in double precision, if power is conserved and if radiance is.
struct OnFloor {
  std::vector<double> power = std::vector<double>(64), radiance = power;
  const std::vector<double>& where(Conserve conserve) const { return conserve == Conserve::power ? power : radiance; }
};

OnFloor rays_on_floor(const TensorField& field, RayBatch (*rays_of)(double&)) {
  const Geometry geometry = geometry_with_floor(field);
  double power_of_ray = 0;
  RayBatch rays = rays_of(power_of_ray);
  rays.wants_log_radiance_scale = true;
  trace_reference(field, geometry, {}, rays);
  OnFloor floor;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    // Only light that meets the cube: it has gone through it, or past its upper edge.
    if (rays.end[i] != RayEnd::obstacle || rays.steps[i] == 0) continue;
    const Eigen::Array2i square = ((rays.position[i].head<2>().array() + 1) / 0.25).floor().cast<int>();
    if (!(square >= 0).all() || !(square < 8).all()) continue;
    const auto at = static_cast<std::size_t>(8 * square.y() + square.x());
    floor.power[at] += power_of_ray;
    floor.radiance[at] += std::exp(rays.log_radiance_scale[i]) * power_of_ray;
  }
  return floor;
}

/// The greatest difference, of the mean.
double difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0, sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, std::abs(a[i] - b[i]));
    sum += b[i];
  }
  return most / (sum / static_cast<double>(b.size()));
}

/// A square has about 1000 rays: 3% noise each, 64 squares.
TEST(FieldPhotonsTest, AFloorWithinTheVolumeHasTheLightOfForwardRays) {
  const TensorField field = lens_field();
  const OnFloor truth = rays_on_floor(field, sun_rays);
  for (const Conserve conserve : {Conserve::power, Conserve::radiance})
    EXPECT_LT(difference(photons_on_floor(field, flexibility, conserve), truth.where(conserve)), 0.2);
  // The wrong sign, and the wrong law.
  EXPECT_GT(difference(photons_on_floor(field, -flexibility, Conserve::power), truth.power), 0.5);
  EXPECT_GT(difference(truth.radiance, truth.power), 0.3);
}

}  // namespace
}  // namespace tensorray
