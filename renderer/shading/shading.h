#pragma once
/// The light that a ray sees: path tracing (Kajiya 1986; Veach 1997) and two fast previews.
///
/// The stages stand in files of their own, as free functions of the batch and of a path (wavefront.h):
/// find_surfaces (shading.cpp) → shade_surface: add_traced_light, sample_direct_light, scatter → wait_at_region →
/// trace_bent_rays → continue_paths, and again from shade_surface on, until no path waits. Without a
/// BendingRegion no path waits.

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "renderer/light_maps/photon_map.h"
#include "renderer/lights/bending_region.h"
#include "renderer/lights/lights.h"
#include "renderer/materials/material.h"
#include "renderer/materials/reflectance_table.h"
#include "renderer/sampling/sampling.h"
#include "renderer/surfaces/surface_scene.h"

namespace tensorray {

enum class Shading {
  path,               ///< All light, by path tracing.
  ambient_occlusion,  ///< The reflectance times the visible fraction of a uniform white sky; one ray per sample.
  headlight,          ///< The reflectance times the cosine to the viewer; no further ray.
};

/// How direct light is sampled. All methods have the same mean; `both` has the least noise.
enum class DirectLight {
  both,      ///< Both, weighted by the power heuristic (Veach and Guibas 1995).
  lights,    ///< Samples the lights only, except for light that only sampling the material can find.
  material,  ///< Samples the material only, except for lights that only sampling the light can find.
};

struct ShadingSettings {
  Shading shading = Shading::path;
  DirectLight direct = DirectLight::both;
  int max_depth = 8;  ///< Most surfaces at which a path scatters; >= 0. 1: direct light only.
  /// After this many surfaces, a path that carries less than a tenth of its luminance may end at random (Russian
  /// roulette); >= 1. With 1, dark surfaces would be noisy under a sky, whose light only the material's samples find.
  int roulette_depth = 2;
  /// Greatest luminance that light scattered twice or more adds, for each sample and surface; 1 is the luminance of the
  /// light that the bands are made from. 0: no limit. The limit removes rare bright paths (fireflies). Light that is
  /// scattered once is never changed. A bent path is limited as if all bands had its radiance.
  double indirect_clamp = 10;
  /// The angle of a pixel as the camera sees it, radians. Bent rays of the camera may be off by a fifth of it, so that
  /// rays of some bands are interpolated between those of others. 0: the ray of each band is traced.
  double pixel_angle = 0;
};

/// The scene to draw. It refers to its parts, which must outlive it.
struct ShadedScene {
  const SurfaceScene& surfaces;
  const std::vector<Material>& materials;  ///< ShadedSurface::material is an index into these.
  const LightSampler& lights;              ///< With the same bands as `colors`.
  const ReflectanceTable& colors;
  /// Where light bends; null: it is straight everywhere. Surfaces get the light of directional lights and points
  /// through the region from `irradiance_maps` or `photons`; only rays of the camera look for it themselves.
  const BendingRegion* region = nullptr;
  /// Bands that a ray of the camera, and a scattered one, follows into the region. Both divide the number of bands.
  int bands_per_view = 1, bands_per_bounce = 1;
  std::vector<IrradianceMap> irradiance_maps = {};  ///< Light that was traced to surfaces through the region.
  /// The same for surfaces without a map; each sample uses one of the passes. Null or without passes: none.
  const PhotonMaps* photons = nullptr;
  std::vector<int> group_of_light = {};  ///< Of each light: the number of its group; −1: it has none. Empty: none has.
  int groups = 0;                        ///< The number of groups, whose light is also added up apart.

  bool has_photons() const { return photons && !photons->passes.empty(); }
  bool has_traced_light() const { return !irradiance_maps.empty() || has_photons(); }
  int layers() const { return (has_traced_light() ? 1 : 0) + groups; }
};

/// @throw std::invalid_argument if a setting is out of range; naming the surface if it has no material, or its light is
/// no area light; naming the material if its bands are not those of `colors`; naming the area light if no surface has
/// its mesh, since the light that paths find by chance would be missing.
void require_shadable(const ShadedScene& scene, const ShadingSettings& settings);

/// The first surface that a ray meets.
struct FirstSurface {
  SurfaceHit hit;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();     ///< As used for shading; towards the viewer.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Of the ray that met it.
  Eigen::Vector3f albedo = Eigen::Vector3f::Zero();     ///< In the working space, as denoisers expect it.
};

/// What the region does to the light of a ray that leaves the camera; means over the bands that it follows, of which
/// those that do not arrive count as 0.
struct BentView {
  double radiance_scale = 1;  ///< Of radiance.
  double deflection = 0;      ///< Angle by which light turns, radians.
  double arrives = 1;         ///< The part of the bands whose way could be followed to its end.
};

/// A ray of the camera: a sample of the picture.
struct ViewRay {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), direction = Eigen::Vector3d::UnitZ();  ///< World; unit.
  PathSampler sampler;  ///< Its dimensions from the third one are for shading.
};

/// What a ray of the camera meets.
struct RayView {
  std::optional<FirstSurface> surface;  ///< The first one. Of a ray that bends, that of the middle one of its bands.
  std::optional<BentView> bent;         ///< If it enters the region.
};

struct Wavefront;

/// Estimates the light that rays see. It reuses its memory: make one for each thread. The scene must outlive it.
///
/// Rays that enter the region wait there, and are then followed together: those of all samples that one call shades, as
/// they leave the camera, then those that the surfaces have scattered that these have met, and so on.
class RayShader {
 public:
  RayShader(const ShadedScene& scene, const ShadingSettings& settings);
  RayShader(RayShader&&) noexcept;
  ~RayShader();

  /// Sets `radiance`, `layer` and `view` of each of `rays`: its result depends on that ray alone. The mean of the
  /// estimate is exact, apart from clamping.
  /// @param show_background  False: a ray that meets nothing sees no light.
  void shade(const std::vector<ViewRay>& rays, bool show_background);

  /// In every band.
  Eigen::ArrayXXd::ConstColXpr radiance(std::size_t ray) const { return layer(ray, -1); }

  /// Parts of `radiance`: what irradiance_maps and photons have lit, if there are any; then the light of each group.
  Eigen::ArrayXXd::ConstColXpr layer(std::size_t ray, int layer) const;

  const RayView& view(std::size_t ray) const;

 private:
  std::unique_ptr<Wavefront> front_;
};

}  // namespace tensorray
