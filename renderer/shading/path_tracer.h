#pragma once
/// @file renderer/shading/path_tracer.h
/// Pictures of surfaces.

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "renderer/film/film.h"
#include "renderer/shading/camera.h"
#include "renderer/shading/pixel_filter.h"
#include "renderer/shading/shading.h"

namespace tensorray {

struct PathTracerSettings {
  ShadingSettings shading;
  PixelFilter filter{PixelFilterShape::blackman_harris};
  bool transparent = false;  ///< Where nothing is hit: alpha 0 and no light, or the lights' background with alpha 1.

  int min_samples = 16;   ///< A pixel; >= 2 if there is a threshold. Powers of two are spread best.
  int max_samples = 64;   ///< >= min_samples
  int pass_samples = 16;  ///< Of the passes after the first one, which has min_samples; >= 1.
  /// A pixel is done when its standard error is below this fraction of its luminance, as it estimates them itself and
  /// as the 5 × 5 pixels about it do on average; so none stops because it has not met by chance what is bright there.
  /// Pixels darker than 5 % of the picture's mean are judged as if they were that bright. 0: all samples for all.
  double noise_threshold = 0;

  std::uint64_t seed = 0;
};

/// Planes of width × height pixels, row by row from the top, all finite. Values are averaged over the samples of a
/// pixel, which the filter spreads, so that they are antialiased as the light is.
struct SurfacePicture {
  Film radiance;             ///< A channel for each band; multiplied by alpha where the picture is transparent.
  std::vector<float> alpha;  ///< 1 everywhere unless transparent.
  /// Over the samples that hit something, at the first surface; 0 where there are none.
  std::vector<float> depth;             ///< Along the camera's forward, world units.
  std::vector<Eigen::Vector3f> normal;  ///< World, towards the viewer, as shaded; a mean, so not always unit.
  std::vector<Eigen::Vector3f> albedo;  ///< Of the working space: the reflectance, of metals with Fresnel's.
  /// Over the samples that hit a surface that has such; 0 where there are none.
  std::vector<float> force, arc_length;
  std::vector<float> path;      ///< Number of the path that was hit nearest to the pixel's centre; -1: none.
  std::vector<float> samples;   ///< How many.
  std::vector<float> variance;  ///< Of the pixel's luminance: its squared standard error, had samples been independent.
};

/// What a caller wants to know meanwhile.
struct RenderCallbacks {
  /// Called now and then from the thread that called `render_surfaces`. `total` is the number of samples if no pixel
  /// stops early. May be empty, and may throw, which ends the work and is passed on.
  std::function<void(std::uint64_t done, std::uint64_t total)> progress;
};

/// Runs on all threads; every byte of the result is the same on any number of them.
/// @throw std::invalid_argument if a setting is out of range, or as `require_shadable`.
SurfacePicture render_surfaces(const ShadedScene& scene, const Camera& camera, const PathTracerSettings& settings,
                               const RenderCallbacks& callbacks = {});

}  // namespace tensorray
