#include "renderer/shading/path_tracer.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <tbb/parallel_for.h>

#include "base/errors.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3f;

constexpr int tile_size = 16;
constexpr int neighborhood = 2;           ///< Pixels in each direction that help decide whether a pixel is done.
constexpr double least_luminance = 0.05;  ///< To which errors are compared; fraction of the picture's mean.

void require_valid(const Camera& camera, const PathTracerSettings& settings) {
  require(camera.resolution.minCoeff() >= 1, "the camera's resolution must be >= 1");
  require(settings.min_samples >= 1, "min_samples must be >= 1");
  require(settings.max_samples >= settings.min_samples, "max_samples must be >= min_samples");
  require(settings.pass_samples >= 1, "pass_samples must be >= 1");
  require(settings.noise_threshold >= 0 && std::isfinite(settings.noise_threshold), "noise_threshold must be >= 0");
  require(settings.noise_threshold == 0 || settings.min_samples >= 2,
          "min_samples must be >= 2 where there is a noise_threshold");
}

SurfacePicture empty_picture(int width, int height, const ShadedScene& scene) {
  const int bands = static_cast<int>(scene.colors.bands());
  SurfacePicture picture;
  picture.radiance = Film(width, height, bands);
  if (!scene.landed.empty()) picture.landed = Film(width, height, bands);
  const std::size_t size = picture.radiance.plane_size();
  if (scene.region) {
    picture.gain.assign(size, 1);
    picture.deflection.assign(size, 0);
  }
  for (auto* plane :
       {&picture.alpha, &picture.depth, &picture.force, &picture.arc_length, &picture.samples, &picture.variance})
    plane->assign(size, 0);
  picture.path.assign(size, -1);
  picture.normal.assign(size, Vector3f::Zero());
  picture.albedo.assign(size, Vector3f::Zero());
  return picture;
}

/// Adds one value to a mean; `count` includes it.
template <class Value>
void extend_mean(Value& mean, int count, const Value& value) {
  mean += (value - mean) / static_cast<float>(count);
}

/// Sets the means of a pixel's bands after `samples` more of `count` samples.
void extend_means(const BandValues& sum, int samples, double count, std::size_t index, Film& film) {
  for (Eigen::Index band = 0; band < sum.size(); ++band) {
    double& mean = film.plane(static_cast<int>(band))[index];
    mean += (sum[band] - samples * mean) / count;
  }
}

/// State of a pixel between passes that the picture does not hold.
struct PixelState {
  int samples = 0, hits = 0, force_hits = 0, length_hits = 0, bent = 0;
  bool done = false;
  double luminance = 0, squares = 0;  ///< Mean, and the sum of squared differences from it (Welford 1962).
  double nearest = std::numeric_limits<double>::infinity();  ///< Squared distance from the centre to the path hit.
};

class Rendering {
 public:
  Rendering(const ShadedScene& scene, const Camera& camera, const PathTracerSettings& settings,
            const RenderCallbacks& callbacks)
      : scene_(scene),
        camera_(camera),
        settings_(settings),
        callbacks_(callbacks),
        picture_(empty_picture(camera.resolution.x(), camera.resolution.y(), scene)),
        pixels_(picture_.radiance.plane_size()) {}

  SurfacePicture run();

 private:
  void pass(int samples);
  void render_pixel(int x, int y, int samples, RayShader& shader, BandValues& sum, BandValues& landed);
  void add_bent_view(std::size_t index, const BentView& view);
  void add_surface(std::size_t index, const Vector2d& offset, const FirstSurface& surface, RayShader& shader);
  bool finish_pixels();
  bool is_precise(int x, int y, double floor) const;

  const ShadedScene& scene_;
  const Camera& camera_;
  const PathTracerSettings& settings_;
  const RenderCallbacks& callbacks_;
  SurfacePicture picture_;
  std::vector<PixelState> pixels_;
  std::atomic<std::uint64_t> finished_samples_{0};
};

SurfacePicture Rendering::run() {
  int samples = 0;
  while (true) {
    const int more =
        samples == 0 ? settings_.min_samples : std::min(settings_.pass_samples, settings_.max_samples - samples);
    pass(more);
    samples += more;
    if (samples == settings_.max_samples || finish_pixels()) break;
  }
  return std::move(picture_);
}

void Rendering::pass(int samples) {
  const int width = picture_.radiance.width, height = picture_.radiance.height;
  const int columns = (width + tile_size - 1) / tile_size, rows = (height + tile_size - 1) / tile_size;
  const auto caller = std::this_thread::get_id();
  const std::uint64_t total = pixels_.size() * static_cast<std::uint64_t>(settings_.max_samples);
  tbb::parallel_for(0, columns * rows, [&](int tile) {
    RayShader shader(scene_, settings_.shading);
    BandValues sum(scene_.colors.bands()), landed(scene_.colors.bands());
    const int left = tile % columns * tile_size, top = tile / columns * tile_size;
    for (int y = top; y < std::min(top + tile_size, height); ++y)
      for (int x = left; x < std::min(left + tile_size, width); ++x) render_pixel(x, y, samples, shader, sum, landed);
    if (callbacks_.progress && std::this_thread::get_id() == caller) callbacks_.progress(finished_samples_, total);
  });
}

void Rendering::render_pixel(int x, int y, int samples, RayShader& shader, BandValues& sum, BandValues& landed) {
  const std::size_t index = static_cast<std::size_t>(y) * picture_.radiance.width + x;
  PixelState& pixel = pixels_[index];
  if (pixel.done) return;
  sum.setZero();
  landed.setZero();
  for (int i = 0; i < samples; ++i) {
    PathSampler sampler{settings_.seed, index, static_cast<std::uint32_t>(pixel.samples), 0};
    const Vector2d offset = settings_.filter.sample(sampler.next_2d());
    const Vector2d lens = camera_.lens_radius > 0 ? square_to_disk(sampler.next_2d()) : Vector2d(0, 0);
    const CameraRay ray = camera_ray(camera_, Vector2d(x + 0.5, y + 0.5) + offset, lens);
    const auto surface = shader.shade(ray.origin, ray.direction, !settings_.transparent, sampler);
    sum += shader.radiance();
    if (!scene_.landed.empty()) landed += shader.landed();
    if (shader.bent_view()) add_bent_view(index, *shader.bent_view());
    ++pixel.samples;
    const double luminance = scene_.colors.luminance(shader.radiance()), change = luminance - pixel.luminance;
    pixel.luminance += change / pixel.samples;
    pixel.squares += change * (luminance - pixel.luminance);
    if (surface) add_surface(index, offset, *surface, shader);
  }
  const double count = pixel.samples;
  extend_means(sum, samples, count, index, picture_.radiance);
  if (!scene_.landed.empty()) extend_means(landed, samples, count, index, picture_.landed);
  picture_.alpha[index] = settings_.transparent ? static_cast<float>(pixel.hits / count) : 1.0f;
  picture_.samples[index] = static_cast<float>(pixel.samples);
  picture_.variance[index] = pixel.samples > 1 ? static_cast<float>(pixel.squares / (count * (count - 1))) : 0.0f;
  finished_samples_ += static_cast<std::uint64_t>(samples);
}

void Rendering::add_bent_view(std::size_t index, const BentView& view) {
  const int count = ++pixels_[index].bent;
  extend_mean(picture_.gain[index], count, static_cast<float>(view.gain));
  extend_mean(picture_.deflection[index], count, static_cast<float>(view.deflection));
}

void Rendering::add_surface(std::size_t index, const Vector2d& offset, const FirstSurface& surface, RayShader& shader) {
  PixelState& pixel = pixels_[index];
  const double depth = (surface.hit.position - camera_.position).dot(camera_.forward);
  ++pixel.hits;
  extend_mean(picture_.depth[index], pixel.hits, static_cast<float>(depth));
  extend_mean(picture_.normal[index], pixel.hits, Vector3f(surface.normal.cast<float>()));
  extend_mean(picture_.albedo[index], pixel.hits, shader.albedo(surface.hit));
  const SurfaceData data = scene_.surfaces.data(surface.hit);
  if (data.force) extend_mean(picture_.force[index], ++pixel.force_hits, *data.force);
  if (data.arc_length) extend_mean(picture_.arc_length[index], ++pixel.length_hits, *data.arc_length);
  if (data.path && offset.squaredNorm() < pixel.nearest) {
    pixel.nearest = offset.squaredNorm();
    picture_.path[index] = static_cast<float>(*data.path);
  }
}

/// Marks the pixels that are done.
/// @return whether all are done.
bool Rendering::finish_pixels() {
  if (settings_.noise_threshold == 0) return false;
  double sum = 0;
  for (const PixelState& pixel : pixels_) sum += pixel.luminance;
  const double floor = least_luminance * sum / static_cast<double>(pixels_.size());
  bool all_done = true;
  for (int y = 0; y < picture_.radiance.height; ++y)
    for (int x = 0; x < picture_.radiance.width; ++x) {
      PixelState& pixel = pixels_[static_cast<std::size_t>(y) * picture_.radiance.width + x];
      if (pixel.done) continue;
      pixel.done = is_precise(x, y, floor);
      all_done = all_done && pixel.done;
      if (pixel.done) finished_samples_ += static_cast<std::uint64_t>(settings_.max_samples - pixel.samples);
    }
  return all_done;
}

bool Rendering::is_precise(int x, int y, double floor) const {
  const auto precise = [&](double variance, double luminance) {
    return std::sqrt(variance) <= settings_.noise_threshold * std::max(luminance, floor);
  };
  const int width = picture_.radiance.width, height = picture_.radiance.height;
  const std::size_t index = static_cast<std::size_t>(y) * width + x;
  if (!precise(picture_.variance[index], pixels_[index].luminance)) return false;
  double variance = 0, luminance = 0, count = 0;
  for (int row = std::max(y - neighborhood, 0); row <= std::min(y + neighborhood, height - 1); ++row)
    for (int column = std::max(x - neighborhood, 0); column <= std::min(x + neighborhood, width - 1); ++column) {
      const std::size_t neighbor = static_cast<std::size_t>(row) * width + column;
      variance += picture_.variance[neighbor];
      luminance += pixels_[neighbor].luminance;
      count += 1;
    }
  return precise(variance / count, luminance / count);
}

}  // namespace

SurfacePicture render_surfaces(const ShadedScene& scene, const Camera& camera, const PathTracerSettings& settings,
                               const RenderCallbacks& callbacks) {
  require_valid(camera, settings);
  require_shadable(scene, settings.shading);
  return Rendering(scene, camera, settings, callbacks).run();
}

}  // namespace tensorray
