#pragma once
/// Surfaces with materials and lights, as the shading tests look at them.

#include <utility>

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
