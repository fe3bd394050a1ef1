#pragma once
/// The stages of shading, and what they share: rays that are shaded together, the light they have seen, and its path.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "renderer/lights/bending_region.h"
#include "renderer/lights/lights.h"
#include "renderer/materials/material.h"
#include "renderer/sampling/sampling.h"
#include "renderer/shading/shading.h"

namespace tensorray {

/// A point where a path meets a surface. The frame is the material's: +z points outwards.
struct Vertex {
  SurfaceHit hit;
  const Material* material = nullptr;
  double side = 1;            ///< 1: seen from outside, −1: from inside.
  Eigen::Vector3d point;      ///< The point that is lit.
  Eigen::Vector3d normal;     ///< Towards the viewer, as shaded.
  Eigen::Vector3d direction;  ///< Of the ray that found it.
  Eigen::Matrix3d frame;
  BandValues reflectance;  ///< In the bands of the path.
  ViewedMaterial view;     ///< With wo, the direction to the viewer.

  Eigen::Vector3d to_local(const Eigen::Vector3d& towards) const { return frame.transpose() * towards; }

  /// Start of a ray towards `wi`.
  Eigen::Vector3d start(const SurfaceScene& surfaces, const Eigen::Vector3d& wi) const {
    return surfaces.start(hit, point, wi.z() * view.wo.z() < 0 ? -side : side);
  }
};

/// A path that is followed: where it is, and how much of the light that it finds there reaches the camera.
struct PathState {
  std::size_t ray = 0;  ///< Number of the camera's ray.
  PathSampler sampler;
  int depth = 0;          ///< Number of surfaces that it has met.
  int band = -1;          ///< Its only band, after it was bent; −1: all bands.
  double stands_for = 1;  ///< The number of bands of the camera's ray for which `band` stands.
  BandValues throughput;  ///< In its bands.
  Vertex vertex;          ///< The last surface that it has met; unset before the first.

  Eigen::Index first_band() const { return std::max(band, 0); }
  BandRange bands() const { return {first_band(), throughput.size()}; }
};

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
  /// Of the light that is met next, among techniques without photons; of a path that seeks light, in its throughput.
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

/// The luminance of `values`, in the bands of the path, as if its one band stood for all of the light.
inline double brightness(const ShadedScene& scene, const PathState& path, const BandValues& values) {
  return path.band < 0 ? scene.colors.luminance(values) : values[0] / path.stands_for;
}

/// Moves the path to a surface that it has met.
/// @param direction  Of the ray that met it.
void meet_surface(const ShadedScene& scene, const SurfaceHit& hit, const Eigen::Vector3d& direction, PathState& path);

/// Sets the reflectance of a surface in the bands from `first_band` on.
/// @param reflectance  Of as many bands as are wanted.
void set_reflectance(const ShadedScene& scene, const SurfaceHit& hit, Eigen::Index first_band, BandValues& reflectance);

/// What denoisers expect as the colour of a surface, in the working space.
/// @param reflectance  Of the surface, in all bands; changed.
Eigen::Vector3f albedo(const ShadedScene& scene, const SurfaceHit& hit, BandValues& reflectance);

// The stages of shading, in the order in which a path goes through them. Each adds the light that it finds.

// scattered_paths.cpp: paths from their first surface on.

/// Adds the light that the surface which the path has met sends to the camera, as ShadingSettings::shading says.
void shade_surface(Wavefront& front, PathState& path);

// traced_light.cpp: light that was traced to surfaces beforehand, as maps of irradiance and as maps of photons.

/// Adds such light that the last surface of the path scatters.
void add_traced_light(Wavefront& front, PathState& path);

// The light of an area light that comes through the region is found by aiming at the light, by the material, and by
// photons. With the power heuristic, each is weighted by the square of its density at the point, per steradian. That of
// photons is the number that is expected within their radius: density × π r² |cos θ|.

/// What weighs photons against a technique that has chosen `direction` at the last surface of the path.
/// @param pdf  Of that technique, per steradian.
PhotonMis photon_mis(const ShadedScene& scene, const PathState& path, const Eigen::Vector3d& direction, double pdf);

/// The weight of the light of a bent ray that meets `hit`, beside photons.
double mis_weight_beside_photons(const ShadedScene& scene, const WaitingPath& path, const BentRay& ray,
                                 const SurfaceHit& hit);

// direct_light.cpp: light that comes to a surface from lights that it looks for.

/// Samples a light, and adds its light that the last surface of the path scatters. If it would come through the region,
/// a bent path will look for it.
/// @param u  In [0, 1)².
void sample_direct_light(Wavefront& front, PathState& path, const Eigen::Vector2d& u);

/// The weight of light that a direction of the material has found, which sampling the lights finds, too.
/// @param light_pdf  Called if it is needed; returns the density of sampling the lights, per steradian.
template <class Density>
double material_mis_weight(const ShadingSettings& settings, double material_pdf, const Density& light_pdf) {
  if (settings.direct == DirectLight::material) return 1;
  if (settings.direct == DirectLight::lights) return light_pdf() > 0 ? 0 : 1;
  const double ratio = light_pdf() / material_pdf;
  return 1 / (1 + ratio * ratio);
}

// bent_paths.cpp: paths whose rays enter the region. They wait there, and are then traced together, which is faster.

/// Whether a ray enters the region before it meets something at `distance`.
bool enters_region(const ShadedScene& scene, const StraightRay& ray, double distance);

/// Lets a path wait at the region, in its band; a path of all bands, in some, evenly spaced, others for each sample.
/// @param throughput  Of the path, or of light that it seeks; in its bands.
/// @param waiting     With `seeks_light`, `mis_weight` and `photons`.
void wait_at_region(Wavefront& front, const PathState& path, const StraightRay& ray, const BandValues& throughput,
                    WaitingPath waiting);

/// Follows the rays of all paths that wait, which then wait no longer.
void trace_bent_rays(Wavefront& front);

/// Brings the light that was sought, and continues the other paths, as a path for each bent ray.
void continue_paths(Wavefront& front, PathState& path);

// direct_light.cpp: what a path has found is added to the radiance of its camera's ray.

/// Where light comes from: a light, or the background in a direction.
struct LightSource {
  int light = -1;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  bool disks = true;                             ///< See LightSampler::background.
  const std::vector<float>* radiance = nullptr;  ///< Of the background, in the bands of the path.
};

/// Adds light that was scattered at `path.depth` surfaces. Leaves out values that overflow, since one would make the
/// mean infinite.
/// @param light  In the bands of the path; changed if it is limited (ShadingSettings::indirect_clamp).
void add_light(Wavefront& front, const PathState& path, BandValues& light, const LightSource& source);

/// Adds the background's light, times `weight`.
void add_background(Wavefront& front, const PathState& path, const Eigen::Vector3d& direction, double weight,
                    bool disks = true);

/// Adds the light that the surface `hit` emits, if it is that of a light, times `weight`.
/// @param direction  Of the ray that met it.
void add_emission(Wavefront& front, const PathState& path, const SurfaceHit& hit, const Eigen::Vector3d& direction,
                  double weight);

}  // namespace tensorray
