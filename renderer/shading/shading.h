#pragma once
/// @file renderer/shading/shading.h
/// The light that a ray sees: path tracing (Kajiya 1986; Veach 1997) and two fast previews.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "renderer/lights/lights.h"
#include "renderer/materials/material.h"
#include "renderer/materials/reflectance_table.h"
#include "renderer/sampling/sampling.h"
#include "renderer/shading/bending_region.h"
#include "renderer/shading/landed_light.h"
#include "renderer/shading/landed_photons.h"
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
  /// roulette); >= 1. 1 would make dark surfaces noisy in light that only their material finds, such as a sky's.
  int roulette_depth = 2;
  /// Greatest luminance that light scattered twice or more adds, for each sample and surface; 1 is the luminance of the
  /// light that the bands are made from. 0: no limit. The limit removes rare bright paths (fireflies). With the
  /// default, one such path adds at most 10 / samples to a pixel: at 64 samples 0.16, which is 20 times the
  /// neighbouring pixels only if these are below 0.008. Light that is scattered once, which lights most of a picture,
  /// is never changed. Light that many surfaces exchange is rarely changed. Light of one band, which was bent, is
  /// limited as if that of all bands were like it: the eye hardly sees some bands, and bright pixels of their colours
  /// would stay.
  double indirect_clamp = 10;
  /// Radians; the size of a pixel as the camera sees it. Light of the camera may be bent with an error of a fifth of it
  /// at most, so that not each band need be followed. 0: each is.
  double pixel_angle = 0;
  /// World units; beyond it nothing hides the sky.
  double occlusion_distance = std::numeric_limits<double>::infinity();
};

/// The scene to draw. It refers to its parts, which must outlive it.
struct ShadedScene {
  const SurfaceScene& surfaces;
  const std::vector<Material>& materials;  ///< ShadedSurface::material is an index into these.
  const LightSampler& lights;              ///< With the same bands as `colors`.
  const ReflectanceTable& colors;
  /// Where light bends; null: it is straight everywhere. Light of directional lights and points that reaches surfaces
  /// through the region is not looked for, except by rays that leave the camera: it is in `landed`, or in `photons`.
  const BendingRegion* region = nullptr;
  /// Bands that a ray of the camera, and one that surfaces have scattered, follows into the region. Both divide the
  /// number of bands.
  int bands_per_view = 1, bands_per_bounce = 1;
  std::vector<LandedLight> landed = {};    ///< Light that bends on its way to surfaces.
  const TracedPhotons* photons = nullptr;  ///< Light that bends, too, on other surfaces. Samples choose among the
                                           ///< passes. Null or without passes: none.
  std::vector<int> group_of_light = {};  ///< Of each light: the number of its group; −1: it has none. Empty: none has.
  int groups = 0;                        ///< The number of groups, whose light is also added up apart.

  bool has_photons() const { return photons && !photons->passes.empty(); }
  bool has_landed_light() const { return !landed.empty() || has_photons(); }
  int layers() const { return (has_landed_light() ? 1 : 0) + groups; }
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

/// What the region does to the light of a ray that leaves the camera; means over the bands that it follows.
struct BentView {
  double gain = 1;        ///< Of radiance.
  double deflection = 0;  ///< Angle by which light turns, radians.
  double arrives = 1;     ///< The part of the bands whose way could be followed to its end.
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

/// Estimates the light that rays see. It reuses its memory: make one for each thread. The scene must outlive it.
///
/// Rays that enter the region wait there, and are then followed together: those of all samples that one call shades, as
/// they leave the camera, then those that the surfaces have scattered that these have met, and so on.
class RayShader {
 public:
  RayShader(const ShadedScene& scene, const ShadingSettings& settings);

  /// Sets `radiance`, `layer` and `view` of each of `rays`: its result depends on that ray alone. The mean of the
  /// estimate is exact, apart from clamping.
  /// @param show_background  False: a ray that meets nothing sees no light.
  void shade(const std::vector<ViewRay>& rays, bool show_background);

  /// In every band.
  auto radiance(std::size_t ray) const { return light_.col(column(ray)); }

  /// Parts of `radiance`: if there are ShadedScene::landed or photons, what these have lit; then the light of each
  /// group.
  auto layer(std::size_t ray, int layer) const { return light_.col(column(ray) + 1 + layer); }

  const RayView& view(std::size_t ray) const { return views_[ray]; }

 private:
  /// A point where a path meets a surface. The frame is the material's: +z points outwards.
  struct Vertex {
    SurfaceHit hit;
    const Material* material;
    double side;            ///< 1: seen from outside, −1: from inside.
    Eigen::Vector3d point;  ///< The point that is lit.
    Eigen::Vector3d normal;
    Eigen::Vector3d direction;  ///< Of the ray that found it.
    Eigen::Matrix3d frame;
    Eigen::Vector3d wo;
    ViewedMaterial view;

    /// Start of a ray towards `wi`.
    Eigen::Vector3d start(const SurfaceScene& surfaces, const Eigen::Vector3d& wi) const {
      return surfaces.start(hit, point, wi.z() * wo.z() < 0 ? -side : side);
    }
  };

  /// What photons need to be weighed against the technique that has chosen a direction at a surface.
  struct PhotonRivalry {
    double pdf = 0;    ///< Of the direction, per steradian.
    double reach = 0;  ///< Area of the photons' disk, across the direction; 0: photons do not count.
    std::uint32_t surface = 0;
  };

  /// A ray that waits at the region, with its ways: for some of the bands of its path.
  struct WaitingRay {
    std::size_t ray = 0;       ///< Number of the camera's ray.
    int depth = 0;             ///< Number of surfaces that the path has met.
    bool seeks_light = false;  ///< It brings light to a surface, and ends; otherwise, it continues the path.
    double share = 1;          ///< Bands of the path for which each way stands.
    double stands = 1;         ///< Bands of the camera's ray for which it stands.
    double weight = 1;  ///< Of the light that is met next, by its technique's density; it is in the throughput of
                        ///< a ray that seeks light.
    PhotonRivalry rivalry;
    std::size_t first = 0, last = 0;                       ///< Its ways.
    Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< Before it bends.
  };

  /// Rays that wait together.
  struct Wave {
    std::vector<WaitingRay> rays;
    std::vector<BentWay> ways;
    std::vector<double> throughput;  ///< Of each way, in its band.
    void clear() {
      rays.clear();
      ways.clear();
      throughput.clear();
    }
  };

  Eigen::Index column(std::size_t ray) const { return static_cast<Eigen::Index>(ray) * (1 + scene_.layers()); }

  void shade_view(const StraightRay& ray, const std::optional<SurfaceHit>& hit);
  void shade_surface(const Vertex& vertex, int depth);
  void shade_path(Vertex vertex, int depth);
  void shade_occlusion(const Vertex& vertex);
  void carry(int band);
  Eigen::Index first_band() const { return std::max(band_, 0); }
  BandRange bands() const { return {first_band(), throughput_.size()}; }
  void set_albedo(FirstSurface& surface, const BandValues& reflectance);
  Vertex make_vertex(const SurfaceHit& hit, const Eigen::Vector3d& direction);
  void set_reflectance(const SurfaceHit& hit, Eigen::Index first_band, BandValues& reflectance) const;
  PathSampler& sampler() { return samplers_[ray_]; }

  bool bends(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double distance) const;
  double bands_per_followed(int depth) const;
  void wait(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, const BandValues& throughput, int depth,
            double weight, bool seeks_light, const PhotonRivalry& rivalry);
  void continue_path(const WaitingRay& waiting);
  void continue_band(const WaitingRay& waiting, std::size_t number);
  void see_bent(const WaitingRay& waiting);
  void bring_light(const WaitingRay& waiting);

  void add_direct_light(const Vertex& vertex, const Eigen::Vector2d& u, int depth);
  void seek_bent_light(const Vertex& vertex, const Eigen::Vector3d& wi, const Eigen::Vector3d& start, int depth);
  bool is_shadowed(const Eigen::Vector3d& start, const Eigen::Vector3d& point) const;
  void add_landed_light(const Vertex& vertex, int depth);
  void add_photons(const Vertex& vertex, int depth);
  const PhotonPass& photon_pass(int depth);
  PhotonRivalry rivalry(const Vertex& vertex, const Eigen::Vector3d& direction, double pdf, int depth);
  double share_beside_photons(const WaitingRay& waiting, const BentWay& way, const SurfaceHit& hit) const;
  double share_of_photon(const Vertex& vertex, const LandedPhoton& photon, const Eigen::Vector3d& wi,
                         double radius) const;
  void add_landed(int depth, int light);
  void add_background(const Eigen::Vector3d& direction, double weight, int depth, bool disks = true);
  void add_emission(const SurfaceHit& hit, const Eigen::Vector3d& direction, double weight, int depth);
  double survives(double refraction) const;
  template <class Density>
  double material_weight(double material_pdf, const Density& light_pdf) const;

  /// Where light comes from that is added: a light, or the background in a direction.
  struct LightSource {
    int light = -1;
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();
    bool disks = true;                             ///< See LightSampler::background.
    const std::vector<float>* radiance = nullptr;  ///< Of the background.
  };
  void add(int depth, const LightSource& source);
  void add_to_groups(const LightSource& source);

  const ShadedScene& scene_;
  const ShadingSettings settings_;
  std::vector<PathSampler> samplers_;
  std::vector<StraightRay> straight_;  ///< The camera's rays, and what they meet if they are not bent.
  std::vector<std::optional<SurfaceHit>> hits_;
  std::vector<RayView> views_;
  Eigen::ArrayXXd light_;  ///< A column of bands for each ray's radiance and for each of its layers.
  bool show_background_ = true;
  Wave waiting_, followed_;

  // Of the path that is followed.
  std::size_t ray_ = 0;                                          ///< Number of the camera's ray.
  int band_ = -1;                                                ///< Its only band, after it was bent; −1: all bands.
  double stands_ = 1;                                            ///< The number of bands for which `band_` stands.
  BandValues throughput_, reflectance_, weight_, contribution_;  ///< Of its bands.

  /// The light of photons, for each group and for all others, of area lights apart; and one of the lights that it comes
  /// from, or −1.
  struct PhotonSum {
    BandValues scattered;
    int light = -1;
  };
  std::vector<PhotonSum> photon_sums_;
  LightSample light_sample_;
  std::vector<float> background_, of_one_light_;  ///< Of the path's bands.
  BandValues albedo_;                             ///< Of all bands.
  bool aims_bent_ = true;                         ///< Whether sampled lights are looked for through the region.
};

}  // namespace tensorray
