#pragma once
/// @file renderer/camera/path_tracer.h
/// Renders pictures of surfaces by path tracing.

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "base/process/job.h"
#include "renderer/camera/camera.h"
#include "renderer/camera/pixel_filter.h"
#include "renderer/film/film.h"
#include "renderer/shading/shading.h"

namespace tensorray {

struct PathTracerSettings {
  ShadingSettings shading;
  PixelFilter filter{PixelFilterShape::blackman_harris};
  bool transparent = false;  ///< Where nothing is hit: alpha 0 and no light; otherwise the background with alpha 1.

  int min_samples = 16;   ///< First pass, for each pixel; >= 2 if noise_threshold > 0. Best: a power of two.
  int max_samples = 64;   ///< >= min_samples
  int pass_samples = 16;  ///< For each pixel, in every pass after the first; >= 1.
  /// A pixel is done when its standard error is below this fraction of its luminance, both by its own estimate and by
  /// the mean over the 5 × 5 pixels around it that belong to its tile. The mean keeps a pixel from stopping when its
  /// samples have missed a bright feature by chance. Pixels darker than 5 % of the picture's mean, which a few samples
  /// estimate beforehand, are treated as if they had that luminance. 0: all pixels take all samples.
  double noise_threshold = 0;

  /// When so much time has passed, tiles get no more samples; only those without any get `first_samples`. Unless it is
  /// infinite, the first passes are short: `first_samples`, and then as many as a pixel has. What a picture has after
  /// its time depends on the machine, and differs from run to run.
  double max_seconds = std::numeric_limits<double>::infinity();
  int first_samples = 1;  ///< 1 to min_samples.

  std::uint64_t seed = 0;
};

/// Planes of width × height pixels, row by row from the top; all values are finite. Values are means over the samples
/// of a pixel. The pixel filter distributes the samples, so the planes are antialiased like the light.
struct SurfacePicture {
  Film radiance;             ///< One channel for each band; multiplied by alpha if the picture is transparent.
  std::vector<float> alpha;  ///< 1 everywhere if the picture is not transparent.
  /// Means over the samples that hit something, at the first surface; 0 where no sample did.
  std::vector<float> depth;             ///< Along the camera's `forward`, world units.
  std::vector<Eigen::Vector3f> normal;  ///< World, towards the viewer, as shaded; a mean, so its length may be below 1.
  std::vector<Eigen::Vector3f> albedo;  ///< Working space: the reflectance; for metals, times Fresnel's reflectance.
  /// Means over the samples that hit a surface with this attribute; 0 where no sample did.
  std::vector<float> force, arc_length;
  Film landed;  ///< The part of `radiance` that ShadedScene::irradiance_maps has lit, in the working space; empty if
                ///< none has.
  Film groups;  ///< The part of each group of lights: red, green, blue of the first, then of the next. May be empty.
  /// If light bends: means over the samples that enter the region; 1, 0 and 1 where none does. Otherwise empty.
  std::vector<float> radiance_scale, deflection, arrives;  ///< See BentView.
  /// If light bends: means over the samples that hit a plate with a texture, or one on which light has landed.
  std::vector<Eigen::Vector2f> texture;  ///< Place in its texture: 0, 0 is its lower left, 1, 1 its upper right corner.
  std::vector<float> folds;              ///< Sheets of landed light.
  std::vector<float> path;               ///< Number of the path that was hit nearest to the pixel's centre; −1: none.
  std::vector<float> samples;            ///< Number of samples.
  std::vector<float> variance;  ///< Squared standard error of the pixel's luminance if samples were independent.
};

/// Functions that are called during a render.
struct RenderCallbacks {
  /// Called from time to time, on the thread that called `render_surfaces`. `total` is the number of samples if no
  /// pixel stops early. May be empty. An exception that it throws ends the render and reaches the caller.
  std::function<void(std::uint64_t done, std::uint64_t total)> progress;

  /// Keeps the tiles of the picture, its units, as "tile" and a number; null: they are not needed. Only tiles of its
  /// part are rendered, and only until it is stopping: others of the result are black, with 0 samples. What is kept of
  /// a tile depends on scene, camera and settings alone. Of its ranks, the root has the picture.
  Job* job = nullptr;

  /// Gets the picture so far if the job wants it; on the thread that called `render_surfaces`, while others go on.
  std::function<void(const SurfacePicture&)> show;
};

/// Runs on all threads; every byte of the result is the same on any number of threads.
/// @throw std::invalid_argument if a setting is out of range, and as `require_shadable`.
SurfacePicture render_surfaces(const ShadedScene& scene, const Camera& camera, const PathTracerSettings& settings,
                               const RenderCallbacks& callbacks = {});

}  // namespace tensorray
