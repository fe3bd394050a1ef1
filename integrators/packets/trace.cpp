// `trace` of bending.h: in packets where possible, otherwise ray by ray.

#include <cmath>
#include <stdexcept>

#include "integrators/bending/bending.h"
#include "integrators/bending/scalar_tracer.h"
#include "integrators/packets/packet_tracer.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

template <int N>
void trace_ray_by_ray(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                      RayBatch& batch, const Recordings& recordings) {
  Tracer<N> tracer(field, geometry, settings);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const RayEnd end = tracer.trace(start_of<N>(batch, i), strength_of(batch, i, settings), recordings.before(i));
    set_end(batch, i, end, tracer);
  }
  batch.tensor_samples += tracer.samples();
}

void check(const BendingSettings& settings) {
  if (!std::isfinite(settings.scale)) throw std::invalid_argument("the field's scale must be finite");
  if (!(settings.step >= 0) || !std::isfinite(settings.step))
    throw std::invalid_argument("bending.step must be automatic, or a positive number of voxels");
  if (!(settings.tolerance > 0)) throw std::invalid_argument("bending.tolerance must be positive");
  if (settings.max_steps < 1) throw std::invalid_argument("bending.max_steps must be positive");
  if (!(settings.max_length > 0)) throw std::invalid_argument("the greatest length of a ray must be positive");
}

bool has_differentials(const RayBatch& batch) { return !batch.differentials.empty(); }

void prepare(const BendingSettings& settings, RayBatch& batch) {
  check(settings);
  make_room();  // Rays bring pages of a field that has a bound into memory.
  if (has_differentials(batch) && batch.differentials.size() != batch.size())
    throw std::invalid_argument("a batch must have differentials for every ray or for none");
  if (has_differentials(batch) && batch.wants_radiance_change)
    throw std::invalid_argument("rays with differentials have no radiance change; leave out one of them");
  batch.end.resize(batch.size());
  batch.length.resize(batch.size());
  batch.steps.resize(batch.size());
  if (batch.wants_radiance_change) batch.radiance_change.resize(batch.size());
}

void trace_one_by_one(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                      RayBatch& batch, const Recordings& recordings) {
  if (has_differentials(batch))
    trace_ray_by_ray<3>(field, geometry, settings, batch, recordings);
  else
    trace_ray_by_ray<1>(field, geometry, settings, batch, recordings);
}

void trace_batch(const TensorField& field, const Geometry& geometry, const BendingSettings& wanted, RayBatch& batch,
                 const Recordings& recordings) {
  const BendingSettings settings = resolved(wanted, field);
  prepare(settings, batch);
  if (!trace_in_packets(field, geometry, settings, batch, recordings))
    trace_one_by_one(field, geometry, settings, batch, recordings);
}

}  // namespace

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch) {
  trace_batch(field, geometry, settings, batch, {});
}

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<RayRecord>& records) {
  records.resize(batch.size());
  for (RayRecord& record : records) record.clear();
  trace_batch(field, geometry, settings, batch, {&records, nullptr});
}

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<RayPoints>& points) {
  std::vector<RayRecord> records;
  trace(field, geometry, settings, batch, records);
  points.assign(batch.size(), {});
  for (std::size_t i = 0; i < batch.size(); ++i)
    for (std::size_t k = 0; k < records[i].size(); ++k) points[i].push_back(ray_point(field, records[i], k));
}

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<Track>& tracks) {
  tracks.resize(batch.size());
  for (Track& track : tracks) track.clear();  // Keeps the memory that they have allocated.
  trace_batch(field, geometry, settings, batch, {nullptr, &tracks});
}

void trace_reference(const TensorField& field, const Geometry& geometry, const BendingSettings& wanted,
                     RayBatch& batch) {
  const BendingSettings settings = resolved(wanted, field);
  prepare(settings, batch);
  trace_one_by_one(field, geometry, settings, batch, {});
}

}  // namespace tensorray
