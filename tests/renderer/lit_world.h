#pragma once
/// Surfaces with materials and lights, a region that bends light, and photons, as the tests of light look at them.

#include <utility>

#include "renderer/light_maps/photon_tracer.h"
#include "renderer/shading/shading.h"
#include "tests/renderer/shapes.h"
#include "tests/renderer/statistics.h"

namespace tensorray {

/// Light in some bands, and their colours.
struct TestBands {
  /// @param xyz_to_rgb_  By default, the working space is XYZ.
  explicit TestBands(std::vector<Band> bands, const Matrix3d& xyz_to_rgb_ = Matrix3d::Identity())
      : all(std::move(bands)), xyz_to_rgb(xyz_to_rgb_), colors(ReflectanceModel(all, xyz_to_rgb), all, xyz_to_rgb) {}

  BandValues grey(double value) const { return BandValues::Constant(static_cast<Eigen::Index>(all.size()), value); }
  std::vector<float> even(float value) const { return std::vector<float>(all.size(), value); }

  /// The part of each band in the luminance.
  std::vector<float> luminances() const {
    std::vector<float> result;
    for (const Band& band : all) result.push_back(static_cast<float>(band.xyz.y()));
    return result;
  }

  std::vector<Band> all;
  Matrix3d xyz_to_rgb;
  ReflectanceTable colors;
};

inline const TestBands& two_bands() {
  static const TestBands two({{600, 100, 0.5, Vector3d(1, 1, 0)}, {500, 100, 0.5, Vector3d(0, 1, 1)}});
  return two;
}

/// A scene and the objects that it refers to.
struct World {
  World(const TestBands& bands, std::vector<ShadedSurface> parts, std::vector<Material> materials_,
        std::vector<Light> lights_)
      : surfaces(std::move(parts)),
        materials(std::move(materials_)),
        light_list(std::move(lights_)),
        lights(light_list, bands.luminances(), surfaces.bounds()),
        scene{surfaces, materials, lights, bands.colors} {}
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  SurfaceScene surfaces;
  std::vector<Material> materials;
  std::vector<Light> light_list;
  LightSampler lights;
  ShadedScene scene;
};

/// A floor below a region, lit by `lights`, of which the first may be the area light of a lamp.
struct FloorWorld : World {
  FloorWorld(const TestBands& bands, const BendingRegion& region, const MaterialSettings& floor, double albedo,
             const std::vector<Light>& all_lights)
      : World(bands, parts(all_lights),
              {make_material(floor, bands.grey(albedo)), make_material(Diffuse{}, bands.grey(0))}, all_lights) {
    scene.region = &region;
  }

  static std::vector<ShadedSurface> parts(const std::vector<Light>& lights) {
    std::vector<ShadedSurface> result{surface_of(rectangle_mesh({0, 0, -0.8}, {1, 0, 0}, {0, 1, 0}, {8, 8}))};
    if (const auto* lamp = std::get_if<AreaLight>(&lights[0])) result.push_back(surface_of(lamp->mesh, 1, 0));
    return result;
  }
};

/// The cube [−½, ½]³. Where light enters, it turns about z by an angle for each band, and its radiance changes.
class TurningCube : public BendingRegion {
 public:
  explicit TurningCube(double angle = 0, double radiance_scale = 1) : angle_(angle), radiance_scale_(radiance_scale) {}

  double entry(const Vector3d& origin, const Vector3d& direction) const override {
    return box_entry(Vector3d::Constant(0.5), origin, direction);
  }
  void trace_radiance(std::vector<BentRay>& rays) const override { turn(rays, angle_); }
  void trace_importance(std::vector<BentRay>& rays) const override { turn(rays, -angle_); }

  int lost_band = -1;  ///< Its light does not arrive.

 private:
  void turn(std::vector<BentRay>& rays, double angle) const {
    for (BentRay& ray : rays) {
      ray.position += entry(ray.position, ray.direction) * ray.direction;
      ray.direction = Eigen::AngleAxisd(angle * (1 + ray.band), Vector3d::UnitZ()) * ray.direction;
      ray.arrives = ray.band != lost_band;
      ray.radiance_scale = radiance_scale_;
    }
  }

  double angle_, radiance_scale_;
};

/// Photons of all lights, on the first surface.
inline PhotonTracerSettings photon_settings(std::uint64_t per_pass, int passes = 1, double radius = 0.05) {
  PhotonTracerSettings settings;
  settings.per_pass = per_pass;
  settings.passes = passes;
  settings.radius = radius;
  settings.seed = 4;
  settings.serves = [](int, std::uint32_t surface) { return surface == 0; };
  return settings;
}

/// The radiance in a band (-1: the mean of all), averaged over rays from `from` to `to`. Each ray has its own pixel, so
/// that samples are independent and the estimate of the error is valid.
inline Mean seen(const ShadedScene& scene, const ShadingSettings& settings, const Vector3d& from, const Vector3d& to,
                 std::uint64_t samples, int band = -1) {
  RayShader shader(scene, settings);
  Mean mean;
  for (std::uint64_t i = 0; i < samples; ++i) {
    shader.shade({{from, (to - from).normalized(), {11, i, 0, 0}}}, true);
    mean.add(band < 0 ? shader.radiance(0).mean() : shader.radiance(0)[band]);
  }
  return mean;
}

/// Irradiance of a point in a band; the mean over the passes.
inline Mean photon_irradiance(const PhotonMaps& photons, const SurfaceHit& point, int band) {
  Mean mean;
  for (const PhotonMap& pass : photons.passes) {
    double sum = 0;
    pass.visit(point, band, [&](const Photon& photon, double density) { sum += photon.power * density; });
    mean.add(sum);
  }
  return mean;
}

}  // namespace tensorray
