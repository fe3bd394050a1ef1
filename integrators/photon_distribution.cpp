#include "integrators/photon_distribution.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <stdexcept>

#include <tbb/parallel_for.h>

#include "integrators/fluence.h"

namespace tensorray {
namespace {

constexpr std::uint64_t chunk_size = 4096;  // Positions between two progress reports.
constexpr std::uint64_t task_size = 16;     // Positions that one thread traces at a time.

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// What became of one ray of a chunk.
struct Landing {
  std::int16_t channel = -1;  // -1: the position lies outside of the aperture.
  RayEnd end = RayEnd::missed;
  std::uint32_t steps = 0;
  Eigen::Vector2d pixel;
  Photon photon;  // Only if photons are kept.
};

/// Everything that the threads share and do not change.
struct Job {
  const TensorField& field;
  const Geometry& geometry;
  const Beam& beam;
  const std::vector<LightChannel>& channels;
  const BendingSettings& bending;
  const PhotonSettings& settings;
  const Progress& progress;
  BeamSampler positions;
  int rays_per_position;
  double ray_area;
  FluenceSums* fluence;  // Null unless asked for.
};

/// The channel of the position's ray number `ray`: one in each of `rays_per_position` equal ranges of channels.
int channel_of(const Job& job, int ray, double stratum) {
  const int range = static_cast<int>(job.channels.size()) / job.rays_per_position;
  return ray * range + std::min(static_cast<int>(stratum * range), range - 1);
}

/// Traces the rays of the positions [first, last) and writes what became of them from `landings` on.
std::uint64_t trace_positions(const Job& job, std::uint64_t first, std::uint64_t last, Landing* landings) {
  const Plate& plate = *job.geometry.surfaces().plate;
  thread_local RayBatch batch;
  batch.clear();
  batch.tensor_samples = 0;
  std::vector<Landing*> traced;
  std::vector<Eigen::Vector3d> origins;
  for (std::uint64_t index = first; index < last; ++index) {
    Emission emission;
    const bool emits = job.positions.sample(index, emission);
    for (int ray = 0; ray < job.rays_per_position; ++ray, ++landings) {
      landings->channel = static_cast<std::int16_t>(emits ? channel_of(job, ray, emission.stratum) : -1);
      if (!emits) continue;
      batch.add(emission.origin, job.beam.direction, job.channels[landings->channel].flexibility);
      traced.push_back(landings);
      origins.push_back(emission.origin);
    }
  }
  if (job.fluence) {
    thread_local std::vector<Track> tracks;
    trace(job.field, job.geometry, job.bending, batch, tracks);
    for (std::size_t i = 0; i < traced.size(); ++i)
      job.fluence->add(static_cast<std::size_t>(traced[i]->channel), tracks[i]);
  } else {
    trace(job.field, job.geometry, job.bending, batch);
  }
  for (std::size_t i = 0; i < traced.size(); ++i) {
    Landing& landing = *traced[i];
    landing.end = batch.end[i];
    landing.steps = batch.steps[i];
    // Rounding may take a hit on the plate's edge outside of it.
    landing.pixel = plate.to_pixel(batch.position[i]).cwiseMax(0).cwiseMin(plate.resolution.cast<double>());
    if (!job.settings.keep_photons) continue;
    const LightChannel& channel = job.channels[landing.channel];
    landing.photon = {batch.position[i].cast<float>(), batch.direction[i].cast<float>(), origins[i].cast<float>(),
                      static_cast<float>(channel.wavelength), static_cast<float>(channel.power * job.ray_area)};
  }
  return batch.tensor_samples;
}

std::uint64_t trace_chunk(const Job& job, std::uint64_t first, std::uint64_t last, std::vector<Landing>& landings) {
  std::atomic<std::uint64_t> samples{0};
  const std::uint64_t tasks = (last - first + task_size - 1) / task_size;
  tbb::parallel_for(std::uint64_t{0}, tasks, [&](std::uint64_t task) {
    if (job.progress.cancelled) throw Cancelled();
    const std::uint64_t from = first + task * task_size, to = std::min(from + task_size, last);
    samples += trace_positions(job, from, to, &landings[(from - first) * job.rays_per_position]);
  });
  return samples;
}

/// Adds a chunk to the estimate and the counts, each channel's rays in their order: sums do not depend on threads.
void collect(const Job& job, const std::vector<Landing>& landings, std::size_t count, DensityEstimator& estimator,
             PhotonDistribution& result) {
  tbb::parallel_for(0, static_cast<int>(result.ends.size()), [&](int channel) {
    std::vector<Eigen::Vector2d> points;
    const std::size_t rays = job.rays_per_position, ray = channel * rays / job.channels.size();
    for (std::size_t i = ray; i < count; i += rays) {  // A channel is always the same ray of its positions.
      if (landings[i].channel != channel) continue;
      ++result.ends[channel][static_cast<int>(landings[i].end)];
      if (landings[i].end == RayEnd::plate) points.push_back(landings[i].pixel);
    }
    estimator.add(channel, points);
  });
  for (std::size_t i = 0; i < count; ++i) result.ray_steps += landings[i].channel < 0 ? 0 : landings[i].steps;
}

void keep_photons(const std::vector<Landing>& landings, std::size_t count, PhotonMap& photons) {
  for (std::size_t i = 0; i < count; ++i)
    if (landings[i].channel >= 0 && landings[i].end == RayEnd::plate) photons.push_back(landings[i].photon);
}

/// Null unless it is asked for.
std::unique_ptr<FluenceSums> make_fluence(const Job& job) {
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
                                      const std::vector<LightChannel>& channels, const BendingSettings& bending,
                                      const PhotonSettings& settings, const Progress& progress) {
  if (!geometry.surfaces().plate) throw std::invalid_argument("photon distribution needs a receiver");
  const Plate& plate = *geometry.surfaces().plate;
  const int rays = rays_per_position(channels, settings);
  Job job{field,   geometry, beam,     channels,
          bending, settings, progress, BeamSampler(beam, settings.pattern, settings.photons, settings.seed),
          rays,    0,        nullptr};
  job.ray_area = job.positions.area_per_candidate() * static_cast<double>(channels.size()) / rays;

  const std::unique_ptr<FluenceSums> fluence = make_fluence(job);
  job.fluence = fluence.get();

  PhotonDistribution result;
  result.ends.assign(channels.size(), EndCounts{});
  result.ray_area = job.ray_area;
  DensityEstimator estimator(plate.resolution.x(), plate.resolution.y(), static_cast<int>(channels.size()),
                             settings.density);
  const std::uint64_t candidates = job.positions.candidates();
  std::vector<Landing> landings(std::min(chunk_size, candidates) * rays);
  for (std::uint64_t first = 0; first < candidates; first += chunk_size) {
    const std::uint64_t last = std::min(first + chunk_size, candidates);
    progress.update("tracing photons", first, candidates);
    auto start = std::chrono::steady_clock::now();
    result.tensor_samples += trace_chunk(job, first, last, landings);
    result.seconds_tracing += seconds_since(start);
    start = std::chrono::steady_clock::now();
    collect(job, landings, (last - first) * rays, estimator, result);
    if (settings.keep_photons) keep_photons(landings, (last - first) * rays, result.photons);
    result.seconds_density += seconds_since(start);
  }
  progress.update("tracing photons", candidates, candidates);
  if (fluence) result.fluence = fluence->grids(job.ray_area);

  const auto start = std::chrono::steady_clock::now();
  result.irradiance = std::move(estimator).finish();
  for (double& value : result.irradiance.values) value *= job.ray_area / plate.pixel_area();
  result.seconds_density += seconds_since(start);
  std::uint64_t rays_traced = 0;
  for (const EndCounts& counts : result.ends)
    for (const std::uint64_t count : counts) rays_traced += count;
  result.positions = rays_traced / rays;
  return result;
}

}  // namespace tensorray
