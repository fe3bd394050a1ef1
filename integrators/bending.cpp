#include "integrators/bending.h"

#include <cmath>
#include <stdexcept>

#include "integrators/packet_tracer.h"
#include "integrators/scalar_tracer.h"

namespace tensorray {
namespace {

/// The rays of a batch, which is N = 3 wide if it carries differentials. `record(i)` says what is kept of ray i.
template <int N, class Record>
void trace_rays(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
                const Record& record) {
  Tracer<N> tracer(field, geometry, settings);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    State<N> start;
    start.P.col(0) = batch.position[i];
    start.V.col(0) = batch.direction[i];
    if constexpr (N == 3) {
      start.P.template rightCols<2>() = batch.differentials[i].position;
      start.V.template rightCols<2>() = batch.differentials[i].direction;
    }
    batch.end[i] = tracer.trace(start, batch.flexibility[i], record(i));
    batch.position[i] = tracer.state().position();
    batch.direction[i] = tracer.state().direction();
    if constexpr (N == 3)
      batch.differentials[i] = {tracer.state().P.template rightCols<2>(), tracer.state().V.template rightCols<2>(),
                                tracer.length_change()};
    batch.length[i] = tracer.length();
    batch.steps[i] = tracer.steps();
  }
  batch.tensor_samples += tracer.samples();
}

void check(const BendingSettings& settings) {
  if (!(settings.step >= 0) || !std::isfinite(settings.step))
    throw std::invalid_argument("bending.step must be automatic, or a positive number of voxels");
  if (!(settings.tolerance > 0)) throw std::invalid_argument("bending.tolerance must be positive");
  if (settings.max_steps < 1) throw std::invalid_argument("bending.max_steps must be positive");
  if (!(settings.max_length > 0)) throw std::invalid_argument("the greatest length of a ray must be positive");
}

bool has_differentials(const RayBatch& batch) { return !batch.differentials.empty(); }

void prepare(const BendingSettings& settings, RayBatch& batch) {
  check(settings);
  if (has_differentials(batch) && batch.differentials.size() != batch.size())
    throw std::invalid_argument("a batch has differentials for every ray, or for none");
  batch.end.resize(batch.size());
  batch.length.resize(batch.size());
  batch.steps.resize(batch.size());
}

template <class Record>
void trace_one_by_one(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                      RayBatch& batch, const Record& record) {
  prepare(settings, batch);
  if (has_differentials(batch))
    trace_rays<3>(field, geometry, settings, batch, record);
  else
    trace_rays<1>(field, geometry, settings, batch, record);
}

}  // namespace

const char* to_string(RayEnd end) {
  constexpr const char* names[ray_end_count] = {"plate", "missed", "obstacle", "step_limit", "degenerate"};
  return names[static_cast<int>(end)];
}

void RayBatch::clear() {
  position.clear();
  direction.clear();
  flexibility.clear();
  differentials.clear();
  end.clear();
  length.clear();
  steps.clear();
}

void RayBatch::add(const Eigen::Vector3d& from, const Eigen::Vector3d& along, double s) {
  position.push_back(from);
  direction.push_back(along);
  flexibility.push_back(s);
}

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch) {
  prepare(settings, batch);
  if (!trace_in_packets(field, geometry, settings, batch)) trace_reference(field, geometry, settings, batch);
}

void trace_reference(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                     RayBatch& batch) {
  trace_one_by_one(field, geometry, settings, batch, [](std::size_t) { return Recording(); });
}

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<Way>& ways) {
  ways.assign(batch.size(), Way());
  trace_one_by_one(field, geometry, settings, batch, [&](std::size_t i) { return Recording{&ways[i], nullptr}; });
}

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<Track>& tracks) {
  tracks.resize(batch.size());
  for (Track& track : tracks) track.clear();  // Keeps what they have allocated.
  trace_one_by_one(field, geometry, settings, batch, [&](std::size_t i) { return Recording{nullptr, &tracks[i]}; });
}

}  // namespace tensorray
