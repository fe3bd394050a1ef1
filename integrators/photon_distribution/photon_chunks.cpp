#include "integrators/photon_distribution/photon_chunks.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "base/process/seconds.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

// Largest number of positions of a chunk, and of its rays: it has work for all threads, and does not take long.
constexpr std::uint64_t largest_chunk = 1u << 16, rays_in_chunk = 1u << 20;
constexpr std::uint64_t task_size = 32;       // Number of positions that one thread traces as one task.
constexpr std::uint64_t rays_in_batch = 512;  // Approximate; all wavelengths of a position stay together.

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

/// A ray that leaves the cut and meets nothing more still crosses the rest of the volume: adds it to its record.
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

PlatePhoton make_photon(const RayBatch& batch, std::size_t ray, const Eigen::Vector3d& origin,
                        const LightChannel& channel, double ray_area) {
  PlatePhoton photon;
  photon.position = batch.position[ray].cast<float>();
  photon.direction = batch.direction[ray].cast<float>();
  photon.origin = origin.cast<float>();
  photon.wavelength = static_cast<float>(channel.wavelength);
  photon.power = static_cast<float>(channel.power * ray_area);
  return photon;
}

/// The ellipse of a photon on the plate, in pixels: the image of a circle across the beam.
Eigen::Matrix2d footprint(const PhotonJob& job, const RayDifferential& differential) {
  const double radius = job.settings.density.footprint * std::sqrt(job.ray_area);
  return radius * job.to_pixel.linear * differential.position;
}

/// Null if no fluence is wanted.
std::unique_ptr<FluenceSums> make_fluence(const PhotonJob& job) {
  if (job.settings.fluence == FluenceKind::none) return nullptr;
  std::vector<double> powers;
  for (const LightChannel& channel : job.channels) powers.push_back(channel.power);
  const std::uint64_t rays = job.positions.candidates() * static_cast<std::uint64_t>(job.rays_per_position);
  return std::make_unique<FluenceSums>(job.field, std::move(powers), job.settings.fluence == FluenceKind::bands, rays);
}

/// Which light it is, and what is kept of it.
struct KeptKind {
  std::uint64_t channels = 0;
  std::uint32_t is_colored = 0, has_fluence = 0, has_photons = 0;
};

void add_photons(Archive& archive, PhotonSums& sums) {
  std::uint64_t chunks = sums.photons.size(), chunk = 0;
  archive.copy(chunks);
  for (auto& [number, photons] : sums.photons) {
    if (archive.reads()) break;
    chunk = number;
    archive.copy(chunk);
    archive.copy_list(photons);
  }
  for (std::uint64_t i = 0; archive.reads() && i < chunks; ++i) {
    std::vector<PlatePhoton> photons;
    archive.copy(chunk);
    archive.copy_list(photons);
    if (sums.has_photons) sums.photons[chunk] = std::move(photons);
  }
}

/// As bytes of their own, which those who do not want it leave out.
void add_fluence(Archive& archive, PhotonSums& sums) {
  std::string bytes;
  if (sums.fluence && !archive.reads()) {
    Archive fluence;
    sums.fluence->copy_sums(fluence);
    bytes = fluence.take();
  }
  archive.copy_list(bytes);
  if (!sums.fluence || !archive.reads()) return;
  Archive fluence(bytes);
  sums.fluence->copy_sums(fluence);
  fluence.finish();
}

}  // namespace

PixelMap::PixelMap(const Plate& plate)
    : offset(plate.to_pixel(Eigen::Vector3d::Zero())), size(plate.resolution.cast<double>()) {
  linear.row(0) = size.x() / plate.size.x() * plate.right.transpose();
  linear.row(1) = -size.y() / plate.size.y() * plate.up.transpose();
}

std::uint64_t PhotonJob::chunk_size() const {
  return std::clamp(rays_in_chunk / rays_per_position, std::uint64_t{1}, largest_chunk);
}

PhotonSums empty_sums(const PhotonJob& job) {
  const PhotonSettings& settings = job.settings;
  const Eigen::Vector2i& pixels = job.geometry.surfaces().plate->resolution;
  const int channels = static_cast<int>(job.channels.size());
  PhotonSums sums;
  sums.emitted.assign(job.channels.size(), 0);
  sums.ends.assign(job.channels.size(), EndCounts{});
  sums.density.emplace(pixels.x(), pixels.y(), channels, settings.density, settings.colors);
  sums.fluence = make_fluence(job);
  sums.is_colored = !settings.colors.empty();
  sums.has_photons = settings.keep_photons;
  return sums;
}

void ChunkTracer::trace(std::uint64_t chunk, PhotonSums& sums) {
  const auto start = Clock::now();
  trace_rays(chunk, sums);
  take_counts(sums);
  for (const std::vector<PlatePhoton>& photons : photons_) {
    std::vector<PlatePhoton>& all = sums.photons[chunk];
    all.insert(all.end(), photons.begin(), photons.end());
  }
  seconds_tracing_ += seconds_since(start);
}

void ChunkTracer::trace_rays(std::uint64_t chunk, PhotonSums& sums) {
  const std::uint64_t candidates = job_.positions.candidates(), first = chunk * job_.chunk_size();
  const std::uint64_t last = std::min(first + job_.chunk_size(), candidates);
  job_.progress.update("tracing photons", first, candidates);
  emit(job_.positions, first, last, emissions_);
  sums.candidates += last - first;
  const std::size_t count = emissions_.size(), tasks = (count + task_size - 1) / task_size;
  if (job_.settings.keep_photons) photons_.resize(tasks);
  std::atomic<std::uint64_t> done{0};
  const std::thread::id caller = std::this_thread::get_id();
  tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
    if (job_.progress.cancelled) throw Cancelled();
    trace_task(task, sums);
    const std::uint64_t traced = done += std::min<std::uint64_t>(task_size, count - task * task_size);
    if (std::this_thread::get_id() == caller) job_.progress.update("tracing photons", first + traced, candidates);
  });
}

/// Traces the rays of a task's positions.
void ChunkTracer::trace_task(std::size_t task, PhotonSums& sums) {
  Worker& worker = workers_.local();
  const std::size_t rays = job_.rays_per_position, first = task * task_size;
  const std::size_t count = std::min<std::size_t>(task_size, emissions_.size() - first);
  const std::size_t batch = std::max<std::size_t>(1, rays_in_batch / rays);
  worker.emitted.resize(job_.channels.size());
  worker.ends.resize(job_.channels.size());
  if (job_.settings.keep_photons) photons_[task].clear();
  for (std::size_t begin = 0; begin < count; begin += batch) {
    fill_batch(first + begin, first + std::min(begin + batch, count), worker);
    trace_batch(worker, sums);
    collect_batch(worker, sums);
    if (!job_.settings.keep_photons) continue;
    for (std::size_t i = 0; i < worker.batch.size(); ++i)
      if (worker.batch.end[i] == RayEnd::plate)
        photons_[task].push_back(make_photon(worker.batch, i, emissions_[first + begin + i / rays].origin,
                                             job_.channels[worker.channels[i]], job_.ray_area));
  }
}

/// With the rays of some positions of the chunk.
void ChunkTracer::fill_batch(std::size_t begin, std::size_t end, Worker& worker) const {
  RayBatch& batch = worker.batch;
  batch.clear();
  worker.channels.clear();
  for (std::size_t position = begin; position < end; ++position) {
    const Emission& emission = emissions_[position];
    batch.position.insert(batch.position.end(), job_.rays_per_position, emission.origin);
    for (int ray = 0; ray < job_.rays_per_position; ++ray) {
      const int channel = channel_of(job_, ray, emission.stratum);
      worker.channels.push_back(static_cast<std::uint16_t>(channel));
      ++worker.emitted[static_cast<std::size_t>(channel)];
      batch.flexibility.push_back(job_.channels[channel].flexibility);
    }
  }
  batch.direction.assign(batch.position.size(), job_.beam.direction);
  if (job_.settings.density.kind != DensityKind::photon_differential) return;
  RayDifferential across;
  across.position << job_.beam.right, job_.beam.up;
  batch.differentials.assign(batch.position.size(), across);
}

void ChunkTracer::trace_batch(Worker& worker, PhotonSums& sums) const {
  tensorray::trace(job_.field, job_.geometry, job_.settings.bending, worker.batch,
                   sums.fluence ? &worker.records : nullptr);
  for (std::size_t i = 0; sums.fluence && i < worker.batch.size(); ++i) {
    record_way_out(job_, worker.batch, i, worker.records[i]);
    sums.fluence->add(worker.channels[i], worker.records[i]);
  }
  if (job_.sides) job_.sides->mark(worker.batch);
}

/// Counts the rays of a batch, and adds those that have landed.
void ChunkTracer::collect_batch(Worker& worker, PhotonSums& sums) const {
  const RayBatch& batch = worker.batch;
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const std::uint16_t channel = worker.channels[i];
    ++worker.ends[channel][static_cast<int>(batch.end[i])];
    worker.ray_steps += batch.steps[i];
    if (batch.end[i] != RayEnd::plate) continue;
    const bool has_footprint = !batch.differentials.empty();
    sums.density->add(channel, job_.to_pixel(batch.position[i]),
                      has_footprint ? footprint(job_, batch.differentials[i]) : Eigen::Matrix2d::Zero());
  }
}

/// Moves the counts of all threads to the sums. They are integers, so that the order does not matter.
void ChunkTracer::take_counts(PhotonSums& sums) {
  for (Worker& worker : workers_) {
    sums.ray_steps += std::exchange(worker.ray_steps, 0);
    sums.tensor_samples += std::exchange(worker.batch.tensor_samples, 0);
    for (std::size_t channel = 0; channel < worker.ends.size(); ++channel) {
      sums.emitted[channel] += worker.emitted[channel];
      for (int end = 0; end < ray_end_count; ++end) sums.ends[channel][end] += worker.ends[channel][end];
    }
    worker.emitted.clear();
    worker.ends.clear();
  }
}

void copy_sums(Archive& archive, PhotonSums& sums) {
  const KeptKind wanted{sums.ends.size(), sums.is_colored, sums.fluence != nullptr, sums.has_photons};
  KeptKind kind = wanted;
  archive.copy(kind);
  if (kind.channels != wanted.channels || kind.is_colored != wanted.is_colored ||
      kind.has_fluence < wanted.has_fluence || kind.has_photons < wanted.has_photons)
    throw DamagedArchive(
        "the photons that were kept are those of other outputs: from the beginning, ask for the same of `spectral`, "
        "`photons` and `fluence`");
  for (std::uint64_t* count : {&sums.candidates, &sums.ray_steps, &sums.tensor_samples}) archive.copy_sums(count, 1);
  archive.copy_sums(sums.emitted.data(), sums.emitted.size());
  for (EndCounts& ends : sums.ends) archive.copy_sums(ends.data(), ends.size());
  add_fluence(archive, sums);
  add_photons(archive, sums);
  sums.density->copy_sums(archive);
}

}  // namespace tensorray
