#include "integrators/probes/auto_scale.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

constexpr double probe_flexibility = 0.2;
constexpr double wanted_turn = 0.15;    // Radians.
constexpr double smallest_turn = 1e-7;  // Radians; a ray that turns less counts as straight.
constexpr std::uint64_t probe_count = 1024;
constexpr std::size_t batch_size = 64;  // Rays that one thread traces together.

std::vector<Eigen::Vector3d> probe_origins(const Beam& beam) {
  const BeamSampler sampler(beam, BeamPattern::stratified, probe_count, 0);
  std::vector<Eigen::Vector3d> origins;
  Emission emission;
  for (std::uint64_t i = 0; i < sampler.candidates(); ++i)
    if (sampler.sample(i, emission)) origins.push_back(emission.origin);
  return origins;
}

/// The turn of the median ray with this scale.
AutoScale probe(const TensorField& field, const Geometry& geometry, const Beam& beam,
                const std::vector<Eigen::Vector3d>& origins, double scale, const Progress& progress) {
  BendingSettings settings;
  settings.scale = scale;
  settings.step = 0.5;  // A fixed step, because the splitting method is stable at any scale.
  std::vector<double> turns(origins.size());
  const std::size_t batches = (origins.size() + batch_size - 1) / batch_size;
  tbb::parallel_for(std::size_t{0}, batches, [&](std::size_t task) {
    if (progress.cancelled) throw Cancelled();
    const std::size_t first = task * batch_size, count = std::min(batch_size, origins.size() - first);
    RayBatch batch;
    for (std::size_t i = 0; i < count; ++i) batch.add(origins[first + i], beam.direction, probe_flexibility);
    trace(field, geometry, settings, batch);
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d& V = batch.direction[i];
      const bool followed = batch.end[i] == RayEnd::plate || batch.end[i] == RayEnd::missed;
      turns[first + i] = followed ? std::atan2(beam.direction.cross(V).norm(), beam.direction.dot(V)) : 0;
    }
  });
  turns.erase(std::remove_if(turns.begin(), turns.end(), [](double turn) { return turn < smallest_turn; }),
              turns.end());
  if (turns.empty()) return {scale, 0, 0};
  const auto median = turns.begin() + static_cast<std::ptrdiff_t>(turns.size() / 2);
  std::nth_element(turns.begin(), median, turns.end());
  return {scale, *median, static_cast<double>(turns.size()) / static_cast<double>(origins.size())};
}

}  // namespace

AutoScale choose_scale(const TensorField& field, const Geometry& geometry, const Beam& beam, const Progress& progress) {
  const double norm = field.greatest_norm();
  if (norm == 0) return {};
  const std::vector<Eigen::Vector3d> origins = probe_origins(beam);
  const double depth = (field.to_world().linear() * field.index_bounds().sizes()).norm();

  // No ray turns by more than s‖T‖ times its length. Start where this bound is small, and double the scale until rays
  // turn enough.
  AutoScale low{0.1 * wanted_turn / (probe_flexibility * norm * depth), 0, 0}, high = low;
  AutoScale best{1, 0, 0};
  for (int doubling = 0; doubling < 50 && high.median_turn < wanted_turn; ++doubling) {
    low = high;
    high = probe(field, geometry, beam, origins, 2 * low.scale, progress);
    if (high.median_turn > best.median_turn) best = high;
  }
  if (best.median_turn < wanted_turn) return best;  // No scale turns rays enough.
  for (int i = 0; i < 20; ++i) {
    const AutoScale middle = probe(field, geometry, beam, origins, (low.scale + high.scale) / 2, progress);
    (middle.median_turn < wanted_turn ? low : high) = middle;
  }
  return high;
}

}  // namespace tensorray
