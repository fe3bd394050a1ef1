#pragma once
/// @file renderer/shading/stages.h
/// The stages of shading, in the order in which a path goes through them. Each adds the light that it finds to the
/// batch; each file has one of them.

#include "renderer/shading/wavefront.h"

namespace tensorray {

// scattered_paths.cpp: paths from their first surface on.

/// Adds the light that the surface which the path has met sends to the camera, as ShadingSettings::shading says.
void shade_surface(Wavefront& front, PathState& path);

// traced_light.cpp: light that was traced to surfaces beforehand, as maps of irradiance (of suns and points on plates
// and bodies) and as maps of photons.

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

// bent_paths.cpp: paths whose rays enter the region. They wait there, and are then traced together: one call with many
// rays is faster than many calls.

/// Whether a ray enters the region before it meets something at `distance`.
bool enters_region(const ShadedScene& scene, const StraightRay& ray, double distance);

/// Lets a path wait at the region, in its band; a path of all bands, in some of them, evenly spaced. Successive samples
/// of a pixel take different bands.
/// @param throughput  Of the path, or of light that it seeks; in its bands.
/// @param waiting     With `seeks_light`, `mis_weight` and `photons`.
void wait_at_region(Wavefront& front, const PathState& path, const StraightRay& ray, const BandValues& throughput,
                    WaitingPath waiting);

/// Follows the rays of all paths that wait, which then wait no longer.
void trace_bent_rays(Wavefront& front);

/// Brings the light that was sought, and continues the other paths, as a path for each bent ray.
void continue_paths(Wavefront& front, PathState& path);

// found_light.cpp: what a path has found is added to the radiance of its camera's ray.

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
