#include "integrators/photons/photon_distribution.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

#include "base/process/seconds.h"
#include "integrators/photons/photon_chunks.h"
#include "integrators/photons/photon_sums.h"

namespace tensorray {
namespace {

constexpr double least_interval = 0.2;        // Seconds between states that are kept.
constexpr double tracing_for_keeping = 20;    // Tracing takes so many times longer than keeping.
constexpr std::uint64_t chunks_in_round = 2;  // That each process of a team traces before it hears from the others.
constexpr std::size_t most_in_message = 1u << 30;  // Bytes.

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

/// The part of the light that has been traced where it has been traced at all. Positions in rows fill the beam row by
/// row; others fill all of it at once.
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
  result.ends = sums.ends;
  std::uint64_t rays = 0;
  for (const EndCounts& ends : sums.ends)
    for (const std::uint64_t count : ends) rays += count;
  result.positions = rays / static_cast<std::uint64_t>(job.rays_per_position);
  const double area = job.ray_area / share_of(job, sums), weight = area / job.geometry.surfaces().plate->pixel_area();
  if (sums.fluence) result.fluence = sums.fluence->grids(area);
  result.irradiance = sums.density->finish(weight);
  return result;
}

/// The units of the work, one after the other. A unit is every so many chunks. Of a team, all processes do each unit
/// together, chunk by chunk in turn; process 0 alone has the states of units.
class PhotonUnits {
 public:
  explicit PhotonUnits(const PhotonJob& job)
      : job_(job),
        work_(job.settings.work),
        team_(job.settings.team),
        units_(of_first(team_, work_ ? std::max(work_->size(), work_->part().count) : std::size_t{1})),
        tracer_(job) {
    if (work_) work_->begin(units_);
  }

  /// At process 0.
  PhotonDistribution run() {
    for (std::size_t unit = 0; unit < units_; ++unit)
      if (units_ == 1 || of_first(team_, !work_ || work_->wants(unit))) trace_unit(unit);
    if (!has_all(team_)) return {};
    if (units_ > 1) add_units();
    job_.progress.update("tracing photons", job_.positions.candidates(), job_.positions.candidates());
    const auto start = Clock::now();
    PhotonDistribution result = distribution_of(job_, sums_);
    result.photons = joined_chunks(std::move(sums_.photons));
    result.seconds_tracing = tracer_.seconds_tracing();
    result.seconds_density = seconds_since(start);
    return result;
  }

 private:
  /// Its memory is freed first.
  void clear_sums() {
    sums_ = PhotonSums();
    sums_ = empty_sums(job_);
  }

  /// Begins with what was kept of a unit.
  void restore(std::size_t unit) {
    const auto state = work_ ? work_->state(unit) : nullptr;
    if (!state) return;
    try {
      add_bytes(*state, sums_);
    } catch (const std::runtime_error&) {
      if (!job_.settings.restarts) throw;
      clear_sums();
    }
  }

  /// Traces what is left of a unit: every chunk whose number, divided by the number of units, leaves that of the unit.
  void trace_unit(std::size_t unit) {
    clear_sums();
    restore(unit);
    const std::uint64_t chunks = unit < job_.chunks() ? (job_.chunks() - unit - 1) / units_ + 1 : 0;
    const std::uint64_t members = team_ ? team_->count() : 1, member = team_ ? team_->index() : 0;
    const std::uint64_t round = team_ ? chunks_in_round * members : 1;
    std::uint64_t next = of_first(team_, (sums_.candidates + job_.chunk_size() - 1) / job_.chunk_size());
    while (next < chunks) {
      const std::uint64_t end = std::min(next + round, chunks);
      for (std::uint64_t i = next + member; i < end; i += members) tracer_.trace(unit + i * units_, sums_);
      next = end;
      if (work_) work_->fraction = static_cast<double>(next) / static_cast<double>(chunks);
      if (next < chunks && of_first(team_, is_due())) keep(unit, false);
    }
    keep(unit, true);
  }

  bool is_due() const {
    const bool is_wanted = job_.settings.show && work_ && work_->picture_wanted;
    const double interval = std::max(least_interval, tracing_for_keeping * seconds_keeping_);
    return work_ && (is_wanted || seconds_since(kept_) > interval);
  }

  /// Brings what the team has traced to process 0, and keeps it there.
  void keep(std::size_t unit, bool is_done) {
    const auto start = Clock::now();
    if (team_) {
      const std::string mine = has_all(team_) ? std::string() : bytes_of(sums_);
      collect_in_turn(*team_, mine, most_in_message, [&](const std::string& bytes) { add_bytes(bytes, sums_); });
    }
    if (!has_all(team_)) {
      clear_sums();
      return;
    }
    // What a picture follows from at once, and is all there is, need not be kept: it takes memory.
    if (work_ && (!is_done || units_ > 1 || work_->is_shard)) work_->keep(unit, bytes_of(sums_), is_done);
    seconds_keeping_ = seconds_since(start);
    if (!is_done) show();
    kept_ = Clock::now();
  }

  void show() const {
    if (!job_.settings.show || !work_ || !work_->picture_wanted.exchange(false)) return;
    PhotonDistribution result = distribution_of(job_, sums_);
    result.photons = joined_chunks(sums_.photons);
    job_.settings.show(std::move(result));
  }

  /// What all units have.
  void add_units() {
    clear_sums();
    for (std::size_t unit = 0; unit < units_; ++unit)
      if (const auto state = work_->state(unit)) add_bytes(*state, sums_);
  }

  const PhotonJob& job_;
  Work* const work_;
  Team* const team_;
  const std::size_t units_;
  ChunkTracer tracer_;
  PhotonSums sums_;  // Of the unit.
  Clock::time_point kept_ = Clock::now();
  double seconds_keeping_ = 0;
};

}  // namespace

PhotonDistribution distribute_photons(const TensorField& field, const Geometry& geometry, const Beam& beam,
                                      const std::vector<LightChannel>& channels, const PhotonSettings& settings,
                                      const Progress& progress) {
  if (!geometry.surfaces().plate) throw std::invalid_argument("photon distribution needs a receiver");
  const int rays = rays_per_position(channels, settings);
  const BeamSampler positions(beam, settings.pattern, settings.photons, settings.seed);
  // The references first; each has a different type, so that they cannot be confused.
  PhotonJob job{field, geometry, beam, channels, settings, progress, positions, PixelMap(*geometry.surfaces().plate)};
  if (!settings.side_light) job.sides.emplace(field, beam.direction);
  job.rays_per_position = rays;
  job.channels_per_ray = static_cast<int>(channels.size()) / rays;
  job.ray_area = positions.area_per_candidate() * static_cast<double>(channels.size()) / rays;
  return PhotonUnits(job).run();
}

}  // namespace tensorray
