#include "renderer/camera/path_tracer.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <thread>

#include <tbb/parallel_for.h>

#include "base/errors.h"
#include "base/process/archive.h"
#include "base/process/seconds.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;

constexpr int tile_size = 16;    ///< Pixels.
constexpr int neighborhood = 2;  ///< Pixels in each direction that help decide whether a pixel is done.
/// Samples that are shaded together. Where light bends, their rays fill packets; otherwise, all that is known of them
/// should stay in the cache of the first level.
constexpr std::size_t bent_batch = 256, straight_batch = 32;
constexpr double round_seconds = 15;    ///< After which ranks give their tiles to the root.
constexpr double min_luminance = 0.05;  ///< To which errors are compared; fraction of the picture's mean.

void require_valid(const Camera& camera, const PathTracerSettings& settings) {
  require(camera.resolution.minCoeff() >= 1, "the camera's resolution must be >= 1");
  require(settings.min_samples >= 1, "min_samples must be >= 1");
  require(settings.max_samples >= settings.min_samples, "max_samples must be >= min_samples");
  require(settings.pass_samples >= 1, "pass_samples must be >= 1");
  require(settings.noise_threshold >= 0 && std::isfinite(settings.noise_threshold), "noise_threshold must be >= 0");
  require(settings.noise_threshold == 0 || settings.min_samples >= 2,
          "min_samples must be >= 2 where there is a noise_threshold");
  require(settings.max_seconds >= 0, "max_seconds must be >= 0");
  require(settings.first_samples >= 1 && settings.first_samples <= settings.min_samples,
          "first_samples must be 1 to min_samples");
}

/// Sets the means of a pixel's light after `samples` more of `count` samples.
void extend_means(const BandsIn& sum, int samples, double count, double* means) {
  for (Eigen::Index i = 0; i < sum.size(); ++i) means[i] += (sum[i] - samples * means[i]) / count;
}

/// A square of the picture: a unit of the work.
struct Tile {
  int left, top, width, height;  ///< In the picture.
  std::size_t color_values;      ///< Numbers of light for each pixel: red, green and blue of all of it, and of layers.
  std::size_t band_values;       ///< The same of all bands; 0: they are not kept.
  std::vector<PixelState> pixels = std::vector<PixelState>(static_cast<std::size_t>(width) * height);  ///< Row by row.
  std::vector<double> colors = std::vector<double>(pixels.size() * color_values);  ///< Means of each pixel's samples.
  std::vector<double> bands = std::vector<double>(pixels.size() * band_values);
  bool is_done = false;  ///< Whether it gets no more samples.

  PixelState& pixel(int x, int y) { return pixels[index(x, y)]; }
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * width + x; }

  /// The samples of pixels that are not done.
  int samples() const {
    int most = 0;
    for (const PixelState& pixel : pixels) most = std::max(most, pixel.samples);
    return most;
  }

  /// To bytes or from them, which may have bands that this one does without. @return whether they have all that it
  /// needs. @throw DamagedArchive.
  bool copy(Archive& archive) {
    std::uint64_t done = is_done, kept_bands = band_values;
    archive.copy(done);
    archive.copy(kept_bands);
    archive.copy_packed(pixels.data(), pixels.size(), sizeof pixels[0]);
    archive.copy_packed(colors.data(), pixels.size(), color_values * sizeof colors[0]);
    std::string skipped;
    if (kept_bands > 0 && band_values == 0) archive.copy_list(skipped);
    if (kept_bands > 0 && band_values > 0)
      archive.copy_packed(bands.data(), pixels.size(), band_values * sizeof bands[0]);
    is_done = done != 0;
    return kept_bands > 0 || band_values == 0;
  }
};

void add_tile(const Tile& tile, SurfacePicture& picture) {
  for (std::size_t i = 0; i < tile.pixels.size(); ++i) {
    const int x = tile.left + static_cast<int>(i) % tile.width, y = tile.top + static_cast<int>(i) / tile.width;
    const std::size_t index = static_cast<std::size_t>(y) * picture.color.width + x;
    const double *color = tile.colors.data() + i * tile.color_values, *band = tile.bands.data() + i * tile.band_values;
    for (Film* film : {&picture.color, &picture.landed, &picture.groups})
      for (int channel = 0; channel < film->channels; ++channel) film->plane(channel)[index] = *color++;
    for (int channel = 0; channel < picture.radiance.channels; ++channel)
      picture.radiance.plane(channel)[index] = *band++;
    picture.pixels[index] = tile.pixels[i];
  }
}
std::string name_of(std::size_t tile) { return "tile " + std::to_string(tile); }

struct TileLists {
  std::vector<std::size_t> part;              ///< Those of this run.
  std::vector<std::size_t> wanted;            ///< Of them, those that this rank renders, and that are not done.
  std::vector<std::size_t> extended;          ///< Those that have more samples than the root knows.
  Clock::time_point gathered = Clock::now();  ///< When the root got the last ones.
};

class Rendering {
 public:
  Rendering(const ShadedScene& scene, const Camera& camera, const PathTracerSettings& settings,
            const RenderCallbacks& callbacks, Job& job)
      : scene_(scene),
        camera_(camera),
        settings_(settings),
        callbacks_(callbacks),
        job_(job),
        width_(camera.resolution.x()),
        height_(camera.resolution.y()),
        columns_((width_ + tile_size - 1) / tile_size),
        tiles_(static_cast<std::size_t>(columns_) * ((height_ + tile_size - 1) / tile_size)),
        band_values_(settings.spectral || job.is_shard ? static_cast<std::size_t>(scene.colors.bands()) : 0) {
    for (std::size_t number = 0; number < tiles_; ++number)
      if (job.has(number)) lists_.part.push_back(number);
  }

  SurfacePicture run() {
    if (settings_.noise_threshold > 0) floor_ = min_luminance * mean_luminance();
    count_samples();
    do {
      lists_.gathered = Clock::now();
      while (!job_.stopping && !lists_.wanted.empty() && !is_round_over()) add_pass();
    } while (!job_.stopping && gather_tiles());
    return picture();
  }

 private:
  /// Samples of pixels, to be shaded together; and the memory of one thread.
  struct Batch {
    Batch(const ShadedScene& scene, const ShadingSettings& settings)
        : shader(scene, settings), sum(Eigen::ArrayXXd::Zero(scene.colors.bands(), 1 + scene.layers())) {}
    RayShader shader;
    std::vector<ViewRay> rays;
    std::vector<Vector2d> offsets;  // Of each sample from its pixel's centre.
    Eigen::ArrayXXd sum;            // Of one pixel's samples: radiance and layers.
  };

  /// A tile as it is kept; without samples if what is kept lacks bands that are wanted now. @throw DamagedArchive.
  Tile load(std::size_t number) const {
    const int left = static_cast<int>(number) % columns_ * tile_size,
              top = static_cast<int>(number) / columns_ * tile_size;
    const Tile empty{left,
                     top,
                     std::min(tile_size, width_ - left),
                     std::min(tile_size, height_ - top),
                     3 + 3 * static_cast<std::size_t>(scene_.layers()),
                     band_values_};
    const Result kept = job_.find(name_of(number));
    if (!kept) return empty;
    Tile tile = empty;
    Archive archive(*kept);
    const bool has_all = tile.copy(archive);
    archive.finish();
    return has_all ? tile : empty;
  }

  /// Ranks render every so many tiles of the part: others in each row of tiles.
  bool is_of_rank(std::size_t place) const {
    return is_mine(job_.ranks, place + lists_.part[place] / static_cast<std::size_t>(columns_));
  }

  /// Gives the root the tiles that have more samples. @return whether any rank has tiles left.
  bool gather_tiles() {
    if (!job_.ranks) return !lists_.wanted.empty();
    std::sort(lists_.extended.begin(), lists_.extended.end());
    lists_.extended.erase(std::unique(lists_.extended.begin(), lists_.extended.end()), lists_.extended.end());
    Archive mine;
    std::size_t left = lists_.wanted.size(), sent = is_root(job_.ranks) ? 0 : lists_.extended.size();
    mine.copy(left);
    std::size_t all = 0;
    for (const std::string& given : job_.ranks->all_gather(mine.take())) {
      Archive(given).copy(left);
      all += left;
    }
    gather_in_turn(job_.ranks, [&](Archive& archive) {
      archive.copy(sent);
      for (std::size_t i = 0; i < sent; ++i) {
        std::size_t number = archive.reads() ? 0 : lists_.extended[i];
        std::string bytes = archive.reads() ? std::string() : *job_.find(name_of(number));
        archive.copy(number);
        archive.copy_list(bytes);
        if (archive.reads()) job_.keep(name_of(number), std::move(bytes));
      }
    });
    lists_.extended.clear();
    return all > 0;
  }

  /// An estimate of the picture's mean luminance from one sample of some pixels. It is the same for every part of the
  /// work, and takes less than a hundredth of its time, but for tiny pictures.
  double mean_luminance() const {
    const int step = 1 + std::max(width_, height_) / 128;
    const int columns = (width_ + step - 1) / step, rows = (height_ + step - 1) / step;
    std::vector<double> luminances(static_cast<std::size_t>(columns) * rows);
    tbb::parallel_for(0, rows, [&](int row) {
      if (is_cancelled()) return;
      Batch batch(scene_, settings_.shading);
      for (int column = 0; column < columns; ++column) add_ray(column * step, row * step, 0, batch);
      batch.shader.shade(batch.rays, !settings_.transparent);
      for (int column = 0; column < columns; ++column)
        luminances[static_cast<std::size_t>(row) * columns + column] =
            scene_.colors.luminance(batch.shader.radiance(static_cast<std::size_t>(column)));
    });
    return std::accumulate(luminances.begin(), luminances.end(), 0.0) / static_cast<double>(luminances.size());
  }

  /// Finds the tiles that are left for this rank. For the progress, counts their samples, and those that are kept.
  void count_samples() {
    const auto most = static_cast<std::uint64_t>(settings_.max_samples);
    for (std::size_t i = 0; i < lists_.part.size(); ++i) {
      const Tile tile = load(lists_.part[i]);
      if (!is_of_rank(i)) continue;
      if (!tile.is_done) lists_.wanted.push_back(lists_.part[i]);
      total_samples_ += tile.pixels.size() * most;
      for (const PixelState& pixel : tile.pixels)
        finished_samples_ += pixel.done != 0 || tile.is_done ? most : static_cast<std::uint64_t>(pixel.samples);
    }
  }

  bool is_round_over() const { return job_.ranks && seconds_since(lists_.gathered) > round_seconds; }

  double time_used() const {
    return std::isinf(settings_.max_seconds) ? 0 : seconds_since(start_) / std::max(settings_.max_seconds, 1e-300);
  }

  /// How many more samples pixels of a tile get that have `before`; 0: none, as the time is over.
  int next_samples(int before) const {
    const int most = std::min(settings_.pass_samples, settings_.max_samples - before);
    if (std::isinf(settings_.max_seconds)) return before == 0 ? settings_.min_samples : most;
    if (before == 0) return settings_.first_samples;
    return time_used() < 1 ? std::min(before, most) : 0;
  }

  void add_ray(int x, int y, int sample, Batch& batch) const {
    PathSampler sampler(settings_.seed, static_cast<std::size_t>(y) * width_ + x, static_cast<std::uint32_t>(sample));
    const Vector2d offset = settings_.filter.sample(sampler.in_pixel());
    const Vector2d lens = camera_.lens_radius > 0 ? square_to_disk(sampler.next_2d()) : Vector2d(0, 0);
    const CameraRay ray = camera_ray(camera_, Vector2d(x + 0.5, y + 0.5) + offset, lens);
    batch.rays.push_back({ray.origin, ray.direction, sampler});
    batch.offsets.push_back(offset);
  }

  /// Gives the tiles that are wanted more samples: ranks only so many as they can until the end of the round.
  void add_pass() {
    const auto caller = std::this_thread::get_id();
    std::vector<char> is_extended(lists_.wanted.size()), is_done(lists_.wanted.size());
    tbb::parallel_for(std::size_t{0}, lists_.wanted.size(), [&](std::size_t i) {
      if (job_.stopping || is_cancelled() || is_round_over()) return;
      Batch batch(scene_, settings_.shading);
      const std::optional<bool> done = extend(lists_.wanted[i], batch);
      if (!done) return;
      is_done[i] = *done ? 1 : 0;
      is_extended[i] = 1;
      if (std::this_thread::get_id() != caller) return;
      report();
      if (callbacks_.show && is_root(job_.ranks) && job_.picture_wanted.exchange(false)) callbacks_.show(picture());
    });
    if (is_cancelled()) report();
    // Those that had no turn are the first of the next pass.
    std::vector<std::size_t> next[2];
    for (std::size_t i = 0; i < lists_.wanted.size(); ++i) {
      if (is_extended[i] != 0) lists_.extended.push_back(lists_.wanted[i]);
      if (is_done[i] == 0) next[static_cast<std::size_t>(is_extended[i])].push_back(lists_.wanted[i]);
    }
    lists_.wanted = std::move(next[0]);
    lists_.wanted.insert(lists_.wanted.end(), next[1].begin(), next[1].end());
  }

  bool is_cancelled() const { return callbacks_.cancelled && *callbacks_.cancelled; }

  /// On the thread that called `render_surfaces`.
  void report() const {
    if (!callbacks_.progress) return;
    const auto by_time = static_cast<std::uint64_t>(std::min(1.0, time_used()) * static_cast<double>(total_samples_));
    callbacks_.progress(std::max(finished_samples_.load(), by_time), total_samples_);
  }

  /// @return whether the tile is done; nothing if the render is cancelled: the tile stays as it was.
  std::optional<bool> extend(std::size_t number, Batch& batch) {
    Tile tile = load(number);
    const int before = tile.samples(), more = next_samples(before), after = before + more;
    const std::size_t batch_samples = scene_.region ? bent_batch : straight_batch;
    for (int y = 0; y < tile.height; ++y)
      for (int x = 0; x < tile.width; ++x) {
        if (tile.pixel(x, y).done != 0) continue;
        for (int sample = before; sample < after; ++sample) {
          add_ray(tile.left + x, tile.top + y, sample, batch);
          if (batch.rays.size() < batch_samples) continue;
          if (is_cancelled()) return std::nullopt;
          shade(tile, before, after, batch);
        }
      }
    shade(tile, before, after, batch);
    const bool has_enough = after == settings_.max_samples || (after >= settings_.min_samples && finish_pixels(tile));
    tile.is_done = has_enough || more == 0;
    Archive archive;
    tile.copy(archive);
    job_.keep(name_of(number), archive.take());
    return tile.is_done;
  }

  /// Shades the batch and adds its samples to their pixels. These had `before` samples, and will have `after`.
  void shade(Tile& tile, int before, int after, Batch& batch) {
    batch.shader.shade(batch.rays, !settings_.transparent);
    for (std::size_t i = 0; i < batch.rays.size(); ++i) {
      const auto width = static_cast<std::uint64_t>(width_), index = batch.rays[i].sampler.pixel;
      const int x = static_cast<int>(index % width) - tile.left, y = static_cast<int>(index / width) - tile.top;
      PixelState& pixel = tile.pixel(x, y);
      add_sample(pixel, i, batch);
      if (pixel.samples == after) add_light(tile, x, y, after - before, batch);
    }
    finished_samples_ += batch.rays.size();
    batch.rays.clear();
    batch.offsets.clear();
  }

  /// Adds sample `number` of the batch: all but its light to the pixel, and its light to the pixel's sum.
  void add_sample(PixelState& pixel, std::size_t number, Batch& batch) const {
    const RayShader& shader = batch.shader;
    const RayView& view = shader.view(number);
    batch.sum.col(0) += shader.radiance(number);
    for (int layer = 0; layer < scene_.layers(); ++layer) batch.sum.col(1 + layer) += shader.layer(number, layer);
    if (view.bent) {
      pixel.radiance_scale.add(view.bent->radiance_scale);
      pixel.deflection.add(view.bent->deflection);
      pixel.arrives.add(view.bent->arrives);
    }
    ++pixel.samples;
    const double luminance = scene_.colors.luminance(shader.radiance(number)), change = luminance - pixel.luminance;
    pixel.luminance += change / pixel.samples;
    pixel.squares += change * (luminance - pixel.luminance);
    if (view.surface) add_surface(pixel, batch.offsets[number], *view.surface);
  }

  void add_light(Tile& tile, int x, int y, int samples, Batch& batch) const {
    const int count = tile.pixel(x, y).samples;
    double* color = &tile.colors[tile.index(x, y) * tile.color_values];
    extend_means(scene_.colors.color(batch.sum.col(0)).array(), samples, count, color);
    for (int layer = 1; layer <= scene_.layers(); ++layer) {  // In single precision, as `albedo`.
      const Eigen::Vector3f sum = scene_.colors.color(batch.sum.col(layer)).cast<float>();
      extend_means(sum.cast<double>().array(), samples, count, color + 3 * layer);
    }
    if (band_values_ > 0) extend_means(batch.sum.col(0), samples, count, &tile.bands[tile.index(x, y) * band_values_]);
    batch.sum.setZero();
  }

  void add_surface(PixelState& pixel, const Vector2d& offset, const FirstSurface& surface) const {
    pixel.depth.add((surface.hit.position - camera_.position).dot(camera_.forward));
    pixel.normal.add(surface.normal);
    pixel.albedo.add(surface.albedo);
    const SurfaceData data = scene_.surfaces.data(surface.hit);
    if (data.force) pixel.force.add(*data.force);
    if (data.arc_length) pixel.arc_length.add(*data.arc_length);
    if (data.path && offset.squaredNorm() < pixel.nearest) {
      pixel.nearest = offset.squaredNorm();
      pixel.path = static_cast<float>(*data.path);
    }
    if (scene_.region) add_place(pixel, surface);
  }

  /// The place in a texture, and the sheets of light that have landed there.
  void add_place(PixelState& pixel, const FirstSurface& surface) const {
    const SurfaceHit& hit = surface.hit;
    if (const auto& texture = scene_.surfaces.surfaces()[hit.surface].texture) {
      const Vector2d place =
          texture->plate.to_pixel(hit.position).cwiseQuotient(texture->plate.resolution.cast<double>());
      pixel.texture.add(Vector2d(place.x(), 1 - place.y()));
    }
    float folds = 0;
    bool is_landed = false;
    for (const IrradianceMap& light : scene_.irradiance_maps) {
      if (light.surface != hit.surface || !is_lit(light, hit.position, surface.direction)) continue;
      folds += folds_at(light, hit.position);
      is_landed = true;
    }
    if (is_landed) pixel.folds.add(folds);
  }

  /// Marks the pixels that are done. Pixels of other tiles do not matter.
  /// @return whether all are done.
  bool finish_pixels(Tile& tile) {
    if (settings_.noise_threshold == 0) return false;
    bool all_done = true;
    for (int y = 0; y < tile.height; ++y)
      for (int x = 0; x < tile.width; ++x) {
        PixelState& pixel = tile.pixel(x, y);
        if (pixel.done != 0) continue;
        pixel.done = is_precise(tile, x, y) ? 1 : 0;
        all_done = all_done && pixel.done != 0;
        if (pixel.done != 0) finished_samples_ += static_cast<std::uint64_t>(settings_.max_samples - pixel.samples);
      }
    return all_done;
  }

  bool is_precise(Tile& tile, int x, int y) const {
    const auto precise = [&](double variance, double luminance) {
      return std::sqrt(variance) <= settings_.noise_threshold * std::max(luminance, floor_);
    };
    if (!precise(tile.pixel(x, y).variance(), tile.pixel(x, y).luminance)) return false;
    double variance = 0, luminance = 0, count = 0;
    for (int row = std::max(y - neighborhood, 0); row <= std::min(y + neighborhood, tile.height - 1); ++row)
      for (int column = std::max(x - neighborhood, 0); column <= std::min(x + neighborhood, tile.width - 1); ++column) {
        variance += tile.pixel(column, row).variance();
        luminance += tile.pixel(column, row).luminance;
        count += 1;
      }
    return precise(variance / count, luminance / count);
  }

  SurfacePicture picture() const {
    SurfacePicture picture;
    picture.color = Film(width_, height_, 3);
    if (settings_.spectral) picture.radiance = Film(width_, height_, static_cast<int>(scene_.colors.bands()));
    if (scene_.has_traced_light()) picture.landed = Film(width_, height_, 3);
    if (scene_.groups > 0) picture.groups = Film(width_, height_, 3 * scene_.groups);
    picture.pixels.resize(picture.color.plane_size());
    picture.transparent = settings_.transparent;
    picture.bends = scene_.region != nullptr;
    for (std::size_t number = 0; number < tiles_; ++number) add_tile(load(number), picture);
    return picture;
  }

  const ShadedScene& scene_;
  const Camera& camera_;
  const PathTracerSettings& settings_;
  const RenderCallbacks& callbacks_;
  Job& job_;
  const int width_, height_, columns_;  ///< Columns of tiles.
  const std::size_t tiles_;
  const std::size_t band_values_;  ///< Of a tile.
  double floor_ = 0;               ///< Least luminance to which errors are compared.
  Clock::time_point start_ = Clock::now();
  TileLists lists_;
  std::uint64_t total_samples_ = 0;
  std::atomic<std::uint64_t> finished_samples_{0};
};

}  // namespace

float SurfacePicture::alpha(std::size_t pixel) const {
  const PixelState& state = pixels[pixel];
  if (!transparent && state.samples > 0) return 1;
  return static_cast<float>(state.depth.count / std::max(1.0, 1.0 * state.samples));
}

SurfacePicture render_surfaces(const ShadedScene& scene, const Camera& camera, const PathTracerSettings& settings,
                               const RenderCallbacks& callbacks) {
  require_valid(camera, settings);
  require_shadable(scene, settings.shading);
  Job own;
  return Rendering(scene, camera, settings, callbacks, callbacks.job ? *callbacks.job : own).run();
}

}  // namespace tensorray
