#pragma once
/// @file renderer/shading/shading.h
/// The light that a ray sees: path tracing (Kajiya 1986; Veach 1997), and two fast previews.

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "renderer/lights/lights.h"
#include "renderer/materials/material.h"
#include "renderer/materials/reflectance_table.h"
#include "renderer/sampling/sampling.h"
#include "renderer/surfaces/surface_scene.h"

namespace tensorray {

enum class Shading {
  path,               ///< All light, by paths.
  ambient_occlusion,  ///< The reflectance, times the part of an evenly white sky that the surface sees: one ray a
                      ///< sample.
  headlight,          ///< The reflectance, times the cosine to the viewer: no ray at all.
};

/// How the light that reaches a surface directly is looked for. All have the same mean; `both` has the least noise.
enum class DirectLight {
  both,      ///< Weighted by the power heuristic (Veach and Guibas 1995).
  lights,    ///< Towards the lights only.
  material,  ///< By what the material scatters only; but lights that only they themselves can find, towards them.
};

struct ShadingSettings {
  Shading shading = Shading::path;
  DirectLight direct = DirectLight::both;
  int max_depth = 8;       ///< Surfaces at which a path scatters; >= 0. 1: direct light alone.
  int roulette_depth = 4;  ///< After so many of them a path may end by chance (Russian roulette); >= 1.
  /// Light that is scattered twice or more counts with at most this luminance for each sample and surface, 1 being that
  /// of the light the bands are made from; 0: no limit. It is what rare bright paths (fireflies) are made of. With the
  /// default one of them adds at most 10 / samples to a pixel: at 64 samples, 0.16, which is 20 times its neighbours
  /// only where these are below 0.008. Light that is scattered once, which lights most of what there is to see, is
  /// never changed; light that many surfaces send to each other, rarely.
  double indirect_clamp = 10;
  double occlusion_distance = std::numeric_limits<double>::infinity();  ///< World units: what is farther hides no sky.
};

/// What is drawn. It refers to its parts, which must outlive it.
struct ShadedScene {
  const SurfaceScene& surfaces;
  const std::vector<Material>& materials;  ///< ShadedSurface::material is an index of these.
  const LightSampler& lights;              ///< Of the bands of `colors`.
  const ReflectanceTable& colors;
};

/// @throw std::invalid_argument if a setting is out of range; naming the surface if it has no material, or a light that
/// is no area light; naming the material if its bands are not those of `colors`; naming the area light if no surface
/// has its mesh, as the light that paths find by chance would be missing.
void require_shadable(const ShadedScene& scene, const ShadingSettings& settings);

/// What the first surface looks like.
struct FirstSurface {
  SurfaceHit hit;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< As shaded: towards the viewer.
};

/// Follows rays. Holds memory that it uses again and again: one for each thread.
class RayShader {
 public:
  RayShader(const ShadedScene& scene, const ShadingSettings& settings);

  /// Sets `radiance()` to what the ray sees, an estimate whose mean is that (less what is clamped).
  /// @param show_background  Otherwise a ray that meets nothing sees no light.
  /// @return the first surface, if there is one.
  std::optional<FirstSurface> shade(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                    bool show_background, PathSampler& sampler);

  const BandValues& radiance() const { return radiance_; }

  /// Of the working space; what denoisers take for the albedo.
  Eigen::Vector3f albedo(const SurfaceHit& hit);

 private:
  struct Vertex;

  Vertex make_vertex(const SurfaceHit& hit, const Eigen::Vector3d& direction);
  void set_reflectance(const SurfaceHit& hit, BandValues& reflectance) const;
  void shade_path(Vertex vertex, PathSampler& sampler);
  void add_direct_light(const Vertex& vertex, int depth, PathSampler& sampler);
  bool is_shadowed(const Eigen::Vector3d& start, const Eigen::Vector3d& point) const;
  void add_background(const Eigen::Vector3d& direction, double weight, int depth);
  void add_emission(const SurfaceHit& hit, const Eigen::Vector3d& direction, double weight, int depth);
  template <class Density>
  double material_weight(double material_pdf, const Density& light_pdf) const;
  void shade_occlusion(const Vertex& vertex, PathSampler& sampler);
  void add(int depth);

  const ShadedScene scene_;
  const ShadingSettings settings_;
  BandValues radiance_, throughput_, reflectance_, weight_, contribution_;
  LightSample light_;
  std::vector<float> background_;
};

}  // namespace tensorray
