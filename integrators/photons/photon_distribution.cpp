#include "integrators/photons/photon_distribution.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <thread>

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "base/process/seconds.h"
#include "integrators/photons/fluence.h"
#include "integrators/photons/photon_state.h"
#include "integrators/tracing/trace.h"
#include "renderer/density/footprint_deposit.h"

namespace tensorray {
namespace {

// Largest number of positions whose landings are sorted and deposited together. Many positions give work to all
// threads, and light that starts together lands together. The number of rays is also limited: their landings take 16
// MiB, and twice that when they are sorted.
constexpr std::uint64_t largest_chunk = 1u << 16, rays_in_chunk = 1u << 20;
constexpr std::uint64_t task_size = 32;       // Number of positions that one thread traces as one task.
constexpr std::uint64_t rays_in_batch = 512;  // Approximate; all wavelengths of a position stay together.

/// Maps world positions to pixels of a plate.
struct PixelMap {
  Eigen::Matrix<double, 2, 3> linear;
  Eigen::Vector2d offset, size;

  explicit PixelMap(const Plate& plate)
      : offset(plate.to_pixel(Eigen::Vector3d::Zero())), size(plate.resolution.cast<double>()) {
    linear.row(0) = size.x() / plate.size.x() * plate.right.transpose();
    linear.row(1) = -size.y() / plate.size.y() * plate.up.transpose();
  }

  /// Clamps the result: rounding may move a hit on the plate's edge off the plate.
  Eigen::Vector2d operator()(const Eigen::Vector3d& world) const {
    return (linear * world + offset).cwiseMax(0).cwiseMin(size);
  }
};

/// What the threads share and do not change.
struct PhotonJob {
  const TensorField& field;
  const Geometry& geometry;
  const Beam& beam;
  const std::vector<LightChannel>& channels;
  const PhotonSettings& settings;
  const Progress& progress;
  const BeamSampler& positions;
  const PixelMap to_pixel;
  int rays_per_position = 0;
  int channels_per_ray = 0;  // A ray carries one of this number of channels.
  double ray_area = 0;
  FluenceSums* fluence = nullptr;            // Null if no fluence is wanted.
  const DensityEstimator* points = nullptr;  // Either this or `footprints` takes the photons on the plate.
  FootprintDeposit* footprints = nullptr;

  std::uint64_t chunk_size() const {
    return std::clamp(rays_in_chunk / rays_per_position, std::uint64_t{1}, largest_chunk);
  }
};

/// The buffers of a thread, and its counts.
struct PhotonWorker {
  RayBatch batch;
  std::vector<RayRecord> records;
  std::vector<std::uint16_t> channels;  // The channel of each ray of the batch.
  std::vector<EndCounts> ends;
  std::uint64_t ray_steps = 0;
};
using PhotonWorkers = tbb::enumerable_thread_specific<PhotonWorker>;

/// A part of the emission, with its landings.
struct Chunk {
  std::vector<Emission> emissions;                // Ordered along a Morton curve.
  std::vector<DensityPoint> landings;             // One for each ray; a default DensityPoint if it is not on the plate.
  std::vector<std::vector<PlatePhoton>> photons;  // One list for each task, if photons are kept.
};

/// The channel of ray number `ray` of a position: one from each of `rays_per_position` equal ranges of channels.
int channel_of(const PhotonJob& job, int ray, double stratum) {
  const int range = job.channels_per_ray;
  return ray * range + std::min(static_cast<int>(stratum * range), range - 1);
}

/// Inserts a zero bit above each bit.
std::uint64_t spread_bits(std::uint32_t value) {
  std::uint64_t bits = value;
  bits = (bits | bits << 8) & 0x00ff00ffu;
  bits = (bits | bits << 4) & 0x0f0f0f0fu;
  bits = (bits | bits << 2) & 0x33333333u;
  return (bits | bits << 1) & 0x55555555u;
}

/// The position on a Morton curve across the beam.
std::uint64_t morton_code(const Eigen::Vector2d& across) {
  const auto cell = [](double value) { return static_cast<std::uint32_t>(std::clamp(value, 0.0, 1.0) * 0xffff); };
  return spread_bits(cell(across.x())) | spread_bits(cell(across.y())) << 1;
}

/// Samples the positions [first, last) that emit. Neighbours follow each other in the result, because their light
/// crosses the same cells of the field and falls on the same pixels.
void emit(const BeamSampler& positions, std::uint64_t first, std::uint64_t last, std::vector<Emission>& emissions) {
  constexpr std::uint64_t none = ~std::uint64_t{0};
  const std::size_t count = last - first;
  std::vector<Emission> sampled(count);
  std::vector<std::uint64_t> order(count);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      order[i] = positions.sample(first + i, sampled[i]) ? morton_code(sampled[i].across) << 32 | i : none;
  });
  tbb::parallel_sort(order.begin(), order.end());
  order.erase(std::lower_bound(order.begin(), order.end(), none), order.end());
  emissions.clear();
  for (const std::uint64_t key : order) emissions.push_back(sampled[static_cast<std::uint32_t>(key)]);
}

void fill_batch(const PhotonJob& job, const Emission* first, const Emission* last, PhotonWorker& worker) {
  RayBatch& batch = worker.batch;
  batch.clear();
  worker.channels.clear();
  for (const Emission* emission = first; emission != last; ++emission) {
    batch.position.insert(batch.position.end(), job.rays_per_position, emission->origin);
    for (int ray = 0; ray < job.rays_per_position; ++ray) {
      const int channel = channel_of(job, ray, emission->stratum);
      worker.channels.push_back(static_cast<std::uint16_t>(channel));
      batch.flexibility.push_back(job.channels[channel].flexibility);
    }
  }
  batch.direction.assign(batch.position.size(), job.beam.direction);
  if (!job.footprints) return;
  RayDifferential across;
  across.position << job.beam.right, job.beam.up;
  batch.differentials.assign(batch.position.size(), across);
}

/// A ray that leaves the cut and meets nothing more still crosses the rest of the volume: adds this piece to its
/// record.
void record_way_out(const PhotonJob& job, const RayBatch& batch, std::size_t ray, RayRecord& record) {
  const Eigen::Vector3d &position = batch.position[ray], &direction = batch.direction[ray];
  const bool is_open = batch.end[ray] == RayEnd::missed && !std::isfinite(job.settings.bending.max_length);
  if (!is_open || !job.field.contains(position)) return;
  const auto exit = job.geometry.crossing(Surface::bounds, false, position, direction);
  if (!exit) return;
  const double length = batch.length[ray];
  record.behind.push_back({position, direction, length});
  record.behind.push_back({position + exit->distance * direction, direction, length + exit->distance});
}

void trace_batch(const PhotonJob& job, PhotonWorker& worker) {
  trace(job.field, job.geometry, job.settings.bending, worker.batch, job.fluence ? &worker.records : nullptr);
  if (!job.fluence) return;
  for (std::size_t i = 0; i < worker.batch.size(); ++i) {
    record_way_out(job, worker.batch, i, worker.records[i]);
    job.fluence->add(worker.channels[i], worker.records[i]);
  }
}

PlatePhoton make_photon(const PhotonJob& job, const PhotonWorker& worker, std::size_t ray,
                        const Eigen::Vector3d& origin) {
  const LightChannel& channel = job.channels[worker.channels[ray]];
  PlatePhoton photon;
  photon.position = worker.batch.position[ray].cast<float>();
  photon.direction = worker.batch.direction[ray].cast<float>();
  photon.origin = origin.cast<float>();
  photon.wavelength = static_cast<float>(channel.wavelength);
  photon.power = static_cast<float>(channel.power * job.ray_area);
  return photon;
}

/// The ellipse of a photon on the plate, in pixels: the image of a circle across the beam.
Eigen::Matrix2d footprint(const PhotonJob& job, const RayDifferential& differential) {
  const double radius = job.settings.density.footprint * std::sqrt(job.ray_area);
  return radius * job.to_pixel.linear * differential.position;
}

/// Counts the rays of a batch and writes their landings: those of the first ray of each position from `landings` on,
/// those of the second rays `step` further on, and so on. Landings of one wavelength from neighbouring positions, which
/// fall on the same pixels, are then next to each other.
void collect_batch(const PhotonJob& job, PhotonWorker& worker, DensityPoint* landings, std::size_t step) {
  const std::size_t rays = job.rays_per_position;
  for (std::size_t i = 0, position = 0; i < worker.batch.size(); ++position)
    for (std::size_t ray = 0; ray < rays; ++ray, ++i) {
      const RayEnd end = worker.batch.end[i];
      const std::uint16_t channel = worker.channels[i];
      ++worker.ends[channel][static_cast<int>(end)];
      worker.ray_steps += worker.batch.steps[i];
      landings[ray * step + position] = DensityPoint();
      if (end != RayEnd::plate) continue;
      const Eigen::Vector2d at = job.to_pixel(worker.batch.position[i]);
      if (job.footprints)
        job.footprints->add(channel, at, footprint(job, worker.batch.differentials[i]));
      else
        landings[ray * step + position] = job.points->point(channel, at);
    }
}

/// Traces the rays of a task's positions.
void trace_task(const PhotonJob& job, std::size_t task, PhotonWorker& worker, Chunk& chunk) {
  const std::size_t rays = job.rays_per_position, first = task * task_size;
  const std::size_t count = std::min<std::size_t>(task_size, chunk.emissions.size() - first);
  const std::size_t batch = std::max<std::size_t>(1, rays_in_batch / rays);
  const Emission* const emissions = &chunk.emissions[first];
  if (worker.ends.empty()) worker.ends.assign(job.channels.size(), EndCounts{});
  if (job.settings.keep_photons) chunk.photons[task].clear();
  for (std::size_t begin = 0; begin < count; begin += batch) {
    const std::size_t end = std::min(begin + batch, count);
    fill_batch(job, emissions + begin, emissions + end, worker);
    trace_batch(job, worker);
    collect_batch(job, worker, &chunk.landings[first * rays + begin], count);
    if (!job.settings.keep_photons) continue;
    for (std::size_t i = 0; i < worker.batch.size(); ++i)
      if (worker.batch.end[i] == RayEnd::plate)
        chunk.photons[task].push_back(make_photon(job, worker, i, emissions[begin + i / rays].origin));
  }
}

/// Traces the positions of a chunk. Only the calling thread reports progress.
void trace_chunk(const PhotonJob& job, std::uint64_t first, std::uint64_t last, PhotonWorkers& workers, Chunk& chunk) {
  emit(job.positions, first, last, chunk.emissions);
  const std::size_t count = chunk.emissions.size(), tasks = (count + task_size - 1) / task_size;
  chunk.landings.resize(count * job.rays_per_position);
  if (job.settings.keep_photons) chunk.photons.resize(tasks);
  std::atomic<std::uint64_t> done{0};
  const std::thread::id caller = std::this_thread::get_id();
  tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
    if (job.progress.cancelled) throw Cancelled();
    trace_task(job, task, workers.local(), chunk);
    const std::uint64_t traced = done += std::min<std::uint64_t>(task_size, count - task * task_size);
    if (std::this_thread::get_id() == caller)
      job.progress.update("tracing photons", first + traced, job.positions.candidates());
  });
}

/// Adds the counts of all threads. They are integers, so that the order does not matter.
void add_counts(const PhotonWorkers& workers, PhotonState& counts) {
  for (const PhotonWorker& worker : workers) {
    counts.ray_steps += worker.ray_steps;
    counts.tensor_samples += worker.batch.tensor_samples;
    for (std::size_t channel = 0; channel < worker.ends.size(); ++channel)
      for (int end = 0; end < ray_end_count; ++end) counts.ends[channel][end] += worker.ends[channel][end];
  }
}

void set_counts(const PhotonState& counts, int rays_per_position, PhotonDistribution& result) {
  result.ray_steps = counts.ray_steps;
  result.tensor_samples = counts.tensor_samples;
  result.ends = counts.ends;
  std::uint64_t rays = 0;
  for (const EndCounts& ends : counts.ends)
    for (const std::uint64_t count : ends) rays += count;
  result.positions = rays / static_cast<std::uint64_t>(rays_per_position);
}

/// Keeps states of the photons in a Work, so that keeping takes a small part of the time.
class PhotonKeeper {
 public:
  explicit PhotonKeeper(Work* work) : work_(work) {}

  bool is_due() const { return work_ && seconds_since(kept_) > std::max(least_interval, 20 * seconds_); }

  void keep(const PhotonState& state) {
    const auto start = Clock::now();
    work_->keep(0, bytes_of(state), false);
    seconds_ = seconds_since(start);
    kept_ = Clock::now();
  }

 private:
  static constexpr double least_interval = 0.2;

  Work* const work_;
  Clock::time_point kept_ = Clock::now();
  double seconds_ = 0;
};

/// Null if no fluence is wanted.
std::unique_ptr<FluenceSums> make_fluence(const PhotonJob& job) {
  if (job.settings.fluence == FluenceKind::none) return nullptr;
  std::vector<double> powers;
  for (const LightChannel& channel : job.channels) powers.push_back(channel.power);
  const std::uint64_t rays = job.positions.candidates() * static_cast<std::uint64_t>(job.rays_per_position);
  return std::make_unique<FluenceSums>(job.field, std::move(powers), job.settings.fluence == FluenceKind::bands, rays);
}

int rays_per_position(const std::vector<LightChannel>& channels, const PhotonSettings& settings) {
  const int count = static_cast<int>(channels.size());
  if (count < 1 || count > 4096) throw std::invalid_argument("light needs between 1 and 4096 wavelengths");
  if (settings.channels_per_photon == 0) return count;
  if (settings.channels_per_photon < 0 || count % settings.channels_per_photon != 0)
    throw std::invalid_argument("the number of wavelengths per photon must divide the number of wavelengths");
  return settings.channels_per_photon;
}

}  // namespace

PhotonDistribution distribute_photons(const TensorField& field, const Geometry& geometry, const Beam& beam,
                                      const std::vector<LightChannel>& channels, const PhotonSettings& settings,
                                      const Progress& progress) {
  if (!geometry.surfaces().plate) throw std::invalid_argument("photon distribution needs a receiver");
  const Plate& plate = *geometry.surfaces().plate;
  const int rays = rays_per_position(channels, settings);
  const BeamSampler positions(beam, settings.pattern, settings.photons, settings.seed);
  // The references first; each has a different type, so that they cannot be confused.
  PhotonJob job{field, geometry, beam, channels, settings, progress, positions, PixelMap(plate)};
  job.rays_per_position = rays;
  job.channels_per_ray = static_cast<int>(channels.size()) / rays;
  job.ray_area = job.positions.area_per_candidate() * static_cast<double>(channels.size()) / rays;

  const std::unique_ptr<FluenceSums> fluence = make_fluence(job);
  job.fluence = fluence.get();

  PhotonDistribution result;
  result.ray_area = job.ray_area;
  std::optional<DensityEstimator> points;
  std::optional<FootprintDeposit> footprints;
  const int width = plate.resolution.x(), height = plate.resolution.y(), count = static_cast<int>(channels.size());
  if (settings.density.kind == DensityKind::photon_differential)
    job.footprints = &footprints.emplace(width, height, count, settings.colors);
  else
    job.points = &points.emplace(width, height, count, settings.density, settings.colors);
  PhotonWorkers workers;
  Chunk chunk;
  const std::uint64_t candidates = job.positions.candidates();
  PhotonState before;
  before.ends.assign(channels.size(), EndCounts{});
  Work* const work = fluence || settings.keep_photons ? nullptr : settings.work;  // These are not kept.
  if (work) work->begin(1);
  if (const auto state = work ? work->state(0) : nullptr) {
    before = photon_state(*state, channels.size());
    points ? points->set_sums(before.sums) : footprints->set_sums(before.sums);
  }
  PhotonKeeper keeper(work);
  for (std::uint64_t first = before.next; first < candidates; first += job.chunk_size()) {
    const std::uint64_t last = std::min(first + job.chunk_size(), candidates);
    progress.update("tracing photons", first, candidates);
    auto start = Clock::now();
    trace_chunk(job, first, last, workers, chunk);
    result.seconds_tracing += seconds_since(start);
    start = Clock::now();
    if (points) points->add(chunk.landings);
    for (const std::vector<PlatePhoton>& photons : chunk.photons)
      result.photons.insert(result.photons.end(), photons.begin(), photons.end());
    result.seconds_density += seconds_since(start);
    if (!keeper.is_due()) continue;
    PhotonState state = before;
    add_counts(workers, state);
    state.next = last;
    state.sums = points ? points->sums() : footprints->sums();
    keeper.keep(state);
    work->fraction = static_cast<double>(last) / static_cast<double>(candidates);
  }
  progress.update("tracing photons", candidates, candidates);
  add_counts(workers, before);
  set_counts(before, rays, result);
  if (fluence) result.fluence = fluence->grids(job.ray_area);

  const auto start = Clock::now();
  const double weight = job.ray_area / plate.pixel_area();
  result.irradiance = points ? std::move(*points).finish(weight) : footprints->finish(weight);
  result.seconds_density += seconds_since(start);
  return result;
}

}  // namespace tensorray
