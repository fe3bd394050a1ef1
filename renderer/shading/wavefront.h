#pragma once
/// @file renderer/shading/wavefront.h
/// What the stages of shading share: the camera's rays that are shaded together, and the light that they have seen.

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "renderer/lights/bending_region.h"
#include "renderer/lights/lights.h"
#include "renderer/shading/path_state.h"

namespace tensorray {

/// What weighs photons against the technique that has chosen a direction at a surface (multiple importance sampling).
struct PhotonMis {
  double pdf = 0;   ///< Of the direction, per steradian.
  double disk = 0;  ///< Area of the photons' disk, across the direction; 0: photons do not count.
  std::uint32_t surface = 0;
};

/// A path that waits at the region, with its bent rays: one for each of some of its bands.
struct WaitingPath {
  std::size_t ray = 0;       ///< Number of the camera's ray.
  int depth = 0;             ///< Number of surfaces that the path has met.
  bool seeks_light = false;  ///< It brings light to a surface, and ends; otherwise, the path continues.
  double share = 1;          ///< Bands of the path for which each bent ray stands.
  double stands_for = 1;     ///< Bands of the camera's ray for which it stands.
  /// Of the light that is met next, among the techniques without photons. A path that seeks light has it in its
  /// throughput.
  double mis_weight = 1;
  PhotonMis photons;
  std::size_t first = 0, last = 0;                       ///< Its bent rays.
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< Before it bends.
};

/// Paths that wait at the region, to be bent together.
struct BentPaths {
  std::vector<WaitingPath> paths;
  std::vector<BentRay> rays;
  std::vector<double> throughput;  ///< Of each ray, in its band.

  void clear() {
    paths.clear();
    rays.clear();
    throughput.clear();
  }
};

/// The light of photons at one surface, of one group of lights.
struct PhotonSum {
  BandValues scattered;
  int light = -1;  ///< One of the lights that it comes from; −1: there is no light.
};

/// Arrays that stages use again for each path. No stage leaves anything in them for another.
struct ShadingMemory {
  BandValues weight, contribution, albedo;
  LightSample light_sample;
  std::vector<float> background, of_one_light;
  std::vector<PhotonSum> photon_sums;
};

/// The scene and the settings must outlive it.
struct Wavefront {
  Wavefront(const ShadedScene& shaded_scene, const ShadingSettings& shading)
      : scene(shaded_scene), settings(shading), aims_bent(scene.lights.is_concentrated()) {}

  const ShadedScene& scene;
  ShadingSettings settings;
  bool aims_bent;  ///< Whether sampled lights are looked for through the region.
  bool show_background = true;
  std::vector<PathSampler> samplers;  ///< Of the camera's rays.
  std::vector<StraightRay> straight;  ///< The camera's rays, and what they meet if they are not bent.
  std::vector<std::optional<SurfaceHit>> hits;
  std::vector<RayView> views;
  Eigen::ArrayXXd light;  ///< A column of bands for the radiance of each ray, and for each of its layers.
  BentPaths waiting, traced;
  ShadingMemory memory;

  /// The column of a ray's radiance; its layers follow.
  Eigen::Index column(std::size_t ray) const { return static_cast<Eigen::Index>(ray) * (1 + scene.layers()); }
};

}  // namespace tensorray
