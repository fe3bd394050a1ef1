#include "tracing/trace/trace.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tracing/steps/scalar_tracer.h"
#include "tracing/trace/packet_tracer.h"

namespace tensorray {
namespace {

template <int N>
void trace_ray_by_ray(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                      RayBatch& batch, RayRecord* records) {
  Tracer<N> tracer(field, geometry, settings);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const RayEnd end =
        tracer.trace(start_of<N>(batch, i), strength_of(batch, i, settings), records ? &records[i].before : nullptr);
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
  if (has_differentials(batch) && batch.differentials.size() != batch.size())
    throw std::invalid_argument("a batch must have differentials for every ray or for none");
  if (has_differentials(batch) && batch.wants_log_radiance_scale)
    throw std::invalid_argument("rays with differentials have no radiance change; leave out one of them");
  batch.end.resize(batch.size());
  batch.length.resize(batch.size());
  batch.steps.resize(batch.size());
  if (batch.wants_log_radiance_scale) batch.log_radiance_scale.resize(batch.size());
}

void trace_one_by_one(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                      RayBatch& batch, RayRecord* records) {
  if (has_differentials(batch))
    trace_ray_by_ray<3>(field, geometry, settings, batch, records);
  else
    trace_ray_by_ray<1>(field, geometry, settings, batch, records);
}

}  // namespace

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& wanted, RayBatch& batch,
           std::vector<RayRecord>* records) {
  const BendingSettings settings = resolved(wanted, field);
  prepare(settings, batch);
  if (records) records->resize(batch.size());
  if (records) std::for_each(records->begin(), records->end(), [](RayRecord& record) { record.clear(); });
  RayRecord* const first = records ? records->data() : nullptr;
  if (!trace_in_packets(field, geometry, settings, batch, first))
    trace_one_by_one(field, geometry, settings, batch, first);
}

void trace_reference(const TensorField& field, const Geometry& geometry, const BendingSettings& wanted,
                     RayBatch& batch) {
  const BendingSettings settings = resolved(wanted, field);
  prepare(settings, batch);
  trace_one_by_one(field, geometry, settings, batch, nullptr);
}

}  // namespace tensorray
