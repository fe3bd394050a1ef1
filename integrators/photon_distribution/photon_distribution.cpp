#include "integrators/photon_distribution/photon_distribution.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "base/process/seconds.h"
#include "integrators/photon_distribution/photon_chunks.h"

namespace tensorray {
namespace {

constexpr double min_interval = 0.2;        // Seconds between states that are kept.
constexpr double tracing_for_keeping = 20;  // Tracing takes so many times longer than keeping.
constexpr double most_wider = 4;            // Photons for light beside the core, at most, as a factor on their number.
constexpr std::uint64_t chunks_in_round = 2;  // That each rank traces before it hears from the others.

int rays_per_position(const std::vector<LightChannel>& channels, const PhotonSettings& settings) {
  const int count = static_cast<int>(channels.size());
  if (count < 1 || count > 4096) throw std::invalid_argument("light needs between 1 and 4096 wavelengths");
  if (settings.channels_per_photon == 0) return count;
  if (settings.channels_per_photon < 0 || count % settings.channels_per_photon != 0)
    throw std::invalid_argument("the number of wavelengths per photon must divide the number of wavelengths");
  return settings.channels_per_photon;
}

/// All photons, in the order of their chunks.
std::vector<PlatePhoton> joined_chunks(std::map<std::uint64_t, std::vector<PlatePhoton>> chunks) {
  std::size_t count = 0;
  for (const auto& [number, photons] : chunks) count += photons.size();
  std::vector<PlatePhoton> all;
  all.reserve(count);
  for (auto& [number, photons] : chunks) {
    all.insert(all.end(), photons.begin(), photons.end());
    std::vector<PlatePhoton>().swap(photons);
  }
  return all;
}

/// The part of the light that is traced where any is: positions in rows fill the beam row by row, others all at once.
double share_of(const PhotonJob& job, const PhotonSums& sums) {
  const BeamPattern pattern = job.settings.pattern;
  if (pattern == BeamPattern::grid || pattern == BeamPattern::stratified || sums.candidates == 0) return 1;
  return static_cast<double>(sums.candidates) / static_cast<double>(job.positions.candidates());
}

/// All but the photons.
PhotonDistribution distribution_of(const PhotonJob& job, const PhotonSums& sums) {
  PhotonDistribution result;
  result.ray_area = job.ray_area;
  result.ray_steps = sums.ray_steps;
  result.tensor_samples = sums.tensor_samples;
  result.emitted = sums.emitted;
  result.ends = sums.ends;
  std::uint64_t rays = 0;
  for (const std::uint64_t count : sums.emitted) rays += count;
  result.positions = rays / static_cast<std::uint64_t>(job.rays_per_position);
  const double area = job.ray_area / share_of(job, sums), weight = area / job.geometry.surfaces().plate->pixel_area();
  if (sums.fluence) result.fluence = sums.fluence->grids(area);
  result.irradiance = sums.density->finish(weight);
  return result;
}

/// The parts of the photons, one after the other. A part is every so many chunks, which ranks trace in turn.
class PhotonParts {
 public:
  explicit PhotonParts(const PhotonJob& job)
      : job_(job),
        kept_(job.settings.job),
        ranks_(kept_ ? kept_->ranks : nullptr),
        parts_(kept_ ? kept_->part().count : 1),
        tracer_(job),
        all_(empty_sums(job)) {}

  /// At the root.
  PhotonDistribution run() {
    for (std::size_t part = 0; part < parts_; ++part)
      if (!kept_ || kept_->has(part)) trace_part(part);
    if (!is_root(ranks_) || (kept_ && kept_->is_shard)) return {};
    job_.progress.update("tracing photons", job_.positions.candidates(), job_.positions.candidates());
    const auto start = Clock::now();
    PhotonDistribution result = distribution_of(job_, all_);
    result.photons = joined_chunks(std::move(all_.photons));
    result.seconds_tracing = tracer_.seconds_tracing();
    result.seconds_density = seconds_since(start);
    return result;
  }

 private:
  /// Traces what is left of a part: every chunk whose number, divided by the number of parts, leaves that of the part.
  /// Until they are gathered, other ranks than the root have sums of their own.
  void trace_part(std::size_t part) {
    const std::string name = "photons " + std::to_string(part);
    const std::uint64_t before = all_.candidates, chunks = (job_.chunks() + parts_ - 1 - part) / parts_;
    if (const Result found = kept_ && is_root(ranks_) ? kept_->find(name) : nullptr) {
      Archive archive(*found);
      copy_sums(archive, all_);
      archive.finish();
    }
    const std::uint64_t step = ranks_ ? ranks_->count() : 1, mine = ranks_ ? ranks_->rank() : 0;
    const std::uint64_t round = ranks_ ? chunks_in_round * step : 1;
    std::uint64_t next = broadcast(ranks_, (all_.candidates - before + job_.chunk_size() - 1) / job_.chunk_size());
    while (next < chunks) {
      const std::uint64_t end = std::min(next + round, chunks);
      for (std::uint64_t i = next + mine; i < end; i += step) tracer_.trace(part + i * parts_, all_);
      next = end;
      if (kept_) kept_->fraction = static_cast<double>(next) / static_cast<double>(chunks);
      // What a picture follows from at once, or has other parts in it, is not kept: it takes memory.
      if (next < chunks && broadcast(ranks_, is_due())) keep(name);
    }
    kept_ && kept_->is_shard ? keep(name) : gather();
  }

  bool is_due() const {
    const bool is_wanted = job_.settings.show && kept_ && kept_->picture_wanted;
    const double interval = std::max(min_interval, tracing_for_keeping * seconds_keeping_);
    return kept_ && (parts_ == 1 || kept_->is_shard) && (is_wanted || seconds_since(time_kept_) > interval);
  }

  /// Brings what the ranks have traced to the root.
  void gather() {
    gather_in_turn(ranks_, [&](Archive& archive) { copy_sums(archive, all_); });
    if (is_root(ranks_)) return;
    all_ = PhotonSums();  // Its memory is freed first.
    all_ = empty_sums(job_);
  }

  void keep(const std::string& name) {
    const auto start = Clock::now();
    gather();
    if (!is_root(ranks_)) return;
    Archive archive;
    copy_sums(archive, all_);
    kept_->keep(name, archive.take());
    seconds_keeping_ = seconds_since(start);
    if (job_.settings.show && kept_->picture_wanted.exchange(false)) {
      PhotonDistribution result = distribution_of(job_, all_);
      result.photons = joined_chunks(all_.photons);
      job_.settings.show(std::move(result));
    }
    time_kept_ = Clock::now();
  }

  const PhotonJob& job_;
  Job* const kept_;
  Ranks* const ranks_;
  const std::size_t parts_;
  ChunkTracer tracer_;
  PhotonSums all_;
  Clock::time_point time_kept_ = Clock::now();
  double seconds_keeping_ = 0;
};

}  // namespace

PhotonDistribution distribute_photons(const TensorField& field, const Geometry& geometry, const Beam& beam,
                                      const std::vector<LightChannel>& channels, const PhotonSettings& settings,
                                      const Progress& progress) {
  if (!geometry.surfaces().plate) throw std::invalid_argument("photon distribution needs a receiver");
  const int rays = rays_per_position(channels, settings);
  // Where light is bent, there are as many as in a beam without light beside it.
  const double wider = std::min(area(beam.aperture) / area(core_of(beam)), most_wider);
  const auto photons = static_cast<std::uint64_t>(std::llround(wider * static_cast<double>(settings.photons)));
  const BeamSampler positions(beam, settings.pattern, photons, settings.seed);
  // The references first; each has a different type, so that they cannot be confused.
  PhotonJob job{field, geometry, beam, channels, settings, progress, positions, PixelMap(*geometry.surfaces().plate)};
  if (!settings.side_light) job.sides.emplace(field, beam.direction);
  job.rays_per_position = rays;
  job.channels_per_ray = static_cast<int>(channels.size()) / rays;
  job.ray_area = positions.area_per_candidate() * static_cast<double>(channels.size()) / rays;
  return PhotonParts(job).run();
}

}  // namespace tensorray
