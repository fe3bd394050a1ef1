#pragma once
/// Renders pictures of surfaces by path tracing.

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <type_traits>
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

  bool spectral = true;  ///< Whether the picture has the light of each band, and not its colours alone.

  std::uint64_t seed = 0;
};

/// A mean over the samples of a pixel that have a value.
template <int size>
struct PixelMean {
  float value[size] = {};  ///< As long as no sample has one, it stays as it is.
  int count = 0;

  template <class Value>
  void add(const Value& sample) {
    ++count;
    for (int i = 0; i < size; ++i) {
      if constexpr (size == 1)
        value[i] += (static_cast<float>(sample) - value[i]) / static_cast<float>(count);
      else
        value[i] += (static_cast<float>(sample[i]) - value[i]) / static_cast<float>(count);
    }
  }
  Eigen::Matrix<float, size, 1> get() const { return Eigen::Map<const Eigen::Matrix<float, size, 1>>(value); }
};

/// What is known of a pixel, beside its light; all values are finite. The pixel filter distributes the samples, so the
/// means are antialiased like the light. What a channel of an EXR shows is a member here, which `add_sample` or
/// `add_surface` (path_tracer.cpp) fill, and a row of `surface_channels` (integrators/path_tracing/stage.cpp).
/// It has no pointers and no gaps: checkpoints keep its bytes.
struct PixelState {
  double luminance = 0, squares = 0;  ///< Mean, and the sum of squared differences from it (Welford 1962).
  double nearest = std::numeric_limits<double>::infinity();  ///< Squared distance from the centre to the path hit.
  int samples = 0;
  int done = 0;     ///< 1: it gets no more samples.
  float path = -1;  ///< Number of the path that was hit nearest to the pixel's centre; −1: none.

  // Of the samples that hit something, at the first surface.
  PixelMean<1> depth;   ///< Along the camera's `forward`, world units.
  PixelMean<3> normal;  ///< World, towards the viewer, as shaded; a mean, so its length may be below 1.
  PixelMean<3> albedo;  ///< Working space: the reflectance; for metals, times Fresnel's reflectance.
  // Of those that hit a surface with this attribute.
  PixelMean<1> force, arc_length;

  // If light bends: BentView of samples that enter the region (divide two by `arrives`); 1, 0 and 1 where none does.
  PixelMean<1> radiance_scale{{1}}, deflection, arrives{{1}};
  PixelMean<2> texture;  ///< Place in the texture of a plate: 0, 0 is its lower left, 1, 1 its upper right corner.
  PixelMean<1> folds;    ///< Sheets of landed light, of a plate on which it has landed.

  /// Squared standard error of the pixel's luminance if samples were independent.
  float variance() const {
    const double count = samples;
    return samples > 1 ? static_cast<float>(squares / (count * (count - 1))) : 0.0f;
  }
};
static_assert(sizeof(PixelState) == 136 && std::is_trivially_copyable_v<PixelState>);

/// Light and pixels, row by row from the top. Light is the mean over the samples of a pixel.
struct SurfacePicture {
  Film color;     ///< In the working space; multiplied by alpha if the picture is transparent.
  Film radiance;  ///< The same with one channel for each band; empty unless PathTracerSettings::spectral.
  Film landed;    ///< The part of `color` that ShadedScene::irradiance_maps has lit, empty if none has.
  Film groups;    ///< The part of each group of lights: red, green, blue of the first, then of the next. May be empty.
  std::vector<PixelState> pixels;
  bool transparent = false, bends = false;  ///< As PathTracerSettings::transparent; whether the scene has a region.

  /// 1 everywhere where there are samples, if the picture is not transparent.
  float alpha(std::size_t pixel) const;
};

/// Functions that are called during a render.
struct RenderCallbacks {
  /// Called from time to time, on the thread that called `render_surfaces`. `total` is the number of samples if no
  /// pixel stops early. May be empty. An exception that it throws ends the render and reaches the caller.
  std::function<void(std::uint64_t done, std::uint64_t total)> progress;

  /// Whether what is being rendered is given up: `progress` is called soon, and throws or stops the job. May be null.
  const std::atomic<bool>* cancelled = nullptr;

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
