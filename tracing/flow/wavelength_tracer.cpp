#include "tracing/flow/wavelength_tracer.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "tracing/flow/ray_memory.h"
#include "tracing/flow/wavelength_prediction.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

constexpr double prediction_part = 300;    // Landings are predicted to within the tolerance divided by this.
constexpr std::size_t first_step = 8;      // 5 samples come first, ...
constexpr std::size_t coarsest_step = 16;  // ... or 3, where the parents agree in what is between them.
constexpr double off_surface = 1e-4;  // Distance, in sizes of a body, at which it is looked for about its own points.

}  // namespace

Eigen::Vector3d place_on(const Plate& plate, const Geometry& geometry, const Beam& beam, const Eigen::Vector3d& point) {
  return geometry.surfaces().body && beam.source ? projected_from(*beam.source, plate, point) : point;
}

WavelengthTracer::WavelengthTracer(const TensorField& field, const Geometry& geometry, const Beam& beam,
                                   const BendingSettings& bending, const FlowSettings& settings)
    : field_(field),
      geometry_(geometry),
      plate_(*settings.plate),
      beam_(beam),
      bending_(bending),
      tolerance_(static_cast<float>(settings.tolerance / prediction_part)),
      is_range_(settings.range && settings.flexibilities[0] != settings.flexibilities[1]),
      flexibilities_(settings.flexibilities) {
  if (settings.range) flexibilities_.resize(is_range_ ? range_samples : 1);
  for (std::size_t i = 0; is_range_ && i < range_samples; ++i) {
    const double part = static_cast<double>(i) / (range_samples - 1);
    flexibilities_[i] = (1 - part) * settings.flexibilities[0] + part * settings.flexibilities[1];
  }
  if (settings.memory && !beam.source && RayMemory::serves(field, geometry, beam.direction, bending)) {
    memory_ = settings.memory;
    volume_.emplace(without_plate(geometry));
  }
  if (geometry.surfaces().body) {
    Surfaces alone;
    alone.bounds = geometry.surfaces().bounds;
    alone.body = geometry.surfaces().body;
    const double off = off_surface * alone.body->bounds().diagonal().norm();
    body_.emplace(Body{Geometry(std::move(alone)), off});
  }
  if (!settings.side_light) sides_.emplace(field, beam.direction);
  const std::size_t step = is_range_ ? first_step : 1;
  for (std::size_t sample = 0; sample < wavelengths(); sample += step) check_samples_.push_back(sample);
}

/// Adds a ray for every `step`-th sample of each vertex; after the first time, only for those that are not known yet.
/// Rays of one sample follow each other: those of neighbouring vertices cross the same cells of the field.
void WavelengthTracer::add_rays(const std::vector<PartlyTraced>& vertices, bool is_first,
                                std::vector<SampleRay>& rays) {
  rays.clear();
  for (std::size_t sample = 0; sample < range_samples; ++sample)
    for (const PartlyTraced& each : vertices)
      if (is_first ? sample % each.step == 0 : sample % (2 * each.step) == each.step && each.prediction.is_open(sample))
        rays.push_back({each.vertex, sample});
}

/// Sets the lengths between those of three samples: as far from the mean of two as those of the parents are.
void WavelengthTracer::predict_lengths(FlowMap& map, std::size_t vertex, const Parents& parents) const {
  const auto missed = [&](std::size_t of, std::size_t check) {
    const float* lengths = &map.lengths[of * check_samples_.size()];
    return lengths[check] - (lengths[check - 1] + lengths[check + 1]) / 2;
  };
  for (std::size_t check = 1; check < check_samples_.size(); check += 2) {
    float& length = map.lengths[vertex * check_samples_.size() + check];
    length -= missed(vertex, check);
    for (std::size_t i = 0; i < parents.count; ++i)
      length += missed(parents.vertices[i], check) / static_cast<float>(parents.count);
  }
}

void WavelengthTracer::trace(FlowMap& map, const std::vector<NewVertex>& vertices) {
  std::vector<SampleRay> rays;
  if (!is_range_) {
    for (std::size_t sample = 0; sample < wavelengths(); ++sample)
      for (std::size_t i = 0; i < vertices.size(); ++i) rays.push_back({i, sample});
    return trace_rays(map, vertices, rays);
  }
  std::vector<PartlyTraced> rest;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const WavelengthPrediction prediction(map, vertices[i].index, vertices[i].parents, plate_.resolution.cast<float>());
    const bool agree = prediction.parents_agree(coarsest_step, tolerance_);
    rest.push_back({i, agree ? coarsest_step : first_step, prediction});
  }
  for (bool is_first = true; !rest.empty(); is_first = false) {
    add_rays(rest, is_first, rays);
    trace_rays(map, vertices, rays);
    const auto is_done = [&](PartlyTraced& each) {
      if (!each.prediction.predict(each.step, tolerance_)) return false;
      const NewVertex& vertex = vertices[each.vertex];
      if (each.step == coarsest_step) predict_lengths(map, vertex.index, vertex.parents);
      return true;
    };
    rest.erase(std::remove_if(rest.begin(), rest.end(), is_done), rest.end());
    for (PartlyTraced& each : rest) each.step /= 2;
  }
}

/// Light on a body counts as landed if it comes from the volume and lands on the first layer of the body.
RayEnd WavelengthTracer::end_of(const RayBatch& rays, std::size_t ray, const Eigen::Vector3d& origin) const {
  if (!body_ || rays.end[ray] != RayEnd::plate) return rays.end[ray];
  if (!geometry_.crossing(Surface::bounds, true, origin, beam_.direction_at(origin), rays.length[ray]))
    return RayEnd::missed;
  const Eigen::Vector3d back =
      beam_.source ? Eigen::Vector3d((*beam_.source - rays.position[ray]).normalized()) : plate_.normal();
  return body_->alone.absorber(rays.position[ray] + body_->off * back, back) ? RayEnd::obstacle : RayEnd::plate;
}

void WavelengthTracer::trace_rays(FlowMap& map, const std::vector<NewVertex>& vertices,
                                  const std::vector<SampleRay>& rays) {
  RayBatch batch;
  for (const SampleRay& ray : rays) {
    const Eigen::Vector3d& origin = vertices[ray.vertex].origin;
    batch.add(origin, beam_.direction_at(origin), flexibilities_[ray.sample]);
  }
  if (memory_)
    memory_->trace(field_, *volume_, geometry_, bending_, batch);
  else
    tensorray::trace(field_, geometry_, bending_, batch);
  if (sides_) sides_->mark(batch);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto& [vertex, sample] = rays[i];
    const NewVertex& of = vertices[vertex];
    const std::size_t at = of.index * wavelengths() + sample;
    map.landings[at] = plate_.to_pixel(place_on(plate_, geometry_, beam_, batch.position[i])).cast<float>();
    map.ends[at] = end_of(batch, i, of.origin);
    if (sample % map.check_step == 0)
      map.lengths[of.index * check_samples_.size() + sample / map.check_step] = static_cast<float>(batch.length[i]);
  }
  rays_ += batch.size();
  tensor_samples_ += batch.tensor_samples;
  ray_steps_ += std::accumulate(batch.steps.begin(), batch.steps.end(), std::uint64_t{0});
}

}  // namespace tensorray
