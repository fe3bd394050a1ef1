#include "integrators/flow/node_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "integrators/flow/node_prediction.h"
#include "integrators/flow/ray_memory.h"

namespace tensorray {
namespace {

constexpr double node_part = 300;          // Landings are predicted to within this part of the tolerance.
constexpr std::size_t first_step = 8;      // 5 nodes come first, ...
constexpr std::size_t coarsest_step = 16;  // ... or 3, where the parents agree in what is between them.
constexpr double off_surface = 1e-4;  // Distance, in sizes of a body, at which it is looked for about its own points.

}  // namespace

Eigen::Vector3d place_on(const Plate& plate, const Geometry& geometry, const Beam& beam, const Eigen::Vector3d& point) {
  return geometry.surfaces().body && beam.source ? projected_from(*beam.source, plate, point) : point;
}

NodeTracer::NodeTracer(const TensorField& field, const Geometry& geometry, const Plate& plate, const Beam& beam,
                       const BendingSettings& bending, const FlowSettings& settings)
    : field_(field),
      geometry_(geometry),
      plate_(plate),
      beam_(beam),
      bending_(bending),
      tolerance_(static_cast<float>(settings.tolerance / node_part)),
      is_range_(settings.range && settings.flexibilities[0] != settings.flexibilities[1]),
      flexibilities_(settings.flexibilities) {
  if (settings.range) flexibilities_.resize(is_range_ ? range_nodes : 1);
  for (std::size_t i = 0; is_range_ && i < range_nodes; ++i) {
    const double part = static_cast<double>(i) / (range_nodes - 1);
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
    off_body_ = off_surface * alone.body->bounds().diagonal().norm();
    body_.emplace(std::move(alone));
  }
  const std::size_t step = is_range_ ? first_step : 1;
  for (std::size_t node = 0; node < nodes(); node += step) check_nodes_.push_back(node);
}

/// Adds every `step`-th node of each position, or, unless it is the first time, those of them that are not known yet.
/// Light of one node from neighbouring positions crosses the same cells of the field.
void NodeTracer::add_rays(const std::vector<PartlyTraced>& positions, bool is_first, std::vector<NodeRay>& rays) {
  rays.clear();
  for (std::size_t node = 0; node < range_nodes; ++node)
    for (const PartlyTraced& each : positions)
      if (is_first ? node % each.step == 0 : node % (2 * each.step) == each.step && each.prediction.is_open(node))
        rays.push_back({each.position, node});
}

/// The lengths between those of three nodes: the parents' ways tell how they bend.
void NodeTracer::predict_lengths(FlowMap& map, std::size_t position, const Parents& parents) const {
  const auto missed = [&](std::size_t of, std::size_t check) {
    const float* lengths = &map.lengths[of * check_nodes_.size()];
    return lengths[check] - (lengths[check - 1] + lengths[check + 1]) / 2;
  };
  for (std::size_t check = 1; check < check_nodes_.size(); check += 2) {
    float& length = map.lengths[position * check_nodes_.size() + check];
    length -= missed(position, check);
    for (std::size_t i = 0; i < parents.count; ++i)
      length += missed(parents.positions[i], check) / static_cast<float>(parents.count);
  }
}

void NodeTracer::trace(FlowMap& map, std::size_t first, const std::vector<NewPosition>& positions) {
  std::vector<NodeRay> rays;
  std::vector<ExitFaces> faces(positions.size());
  if (!is_range_) {
    for (std::size_t node = 0; node < nodes(); ++node)
      for (std::size_t i = 0; i < positions.size(); ++i) rays.push_back({first + i, node});
    return trace_rays(map, first, positions, rays, faces);
  }
  std::vector<PartlyTraced> rest;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const NodePrediction prediction(map, first + i, positions[i].parents, plate_.resolution.cast<float>());
    const bool agree = prediction.parents_agree(coarsest_step, tolerance_);
    rest.push_back({first + i, agree ? coarsest_step : first_step, prediction});
  }
  for (bool is_first = true; !rest.empty(); is_first = false) {
    add_rays(rest, is_first, rays);
    trace_rays(map, first, positions, rays, faces);
    const auto is_done = [&](PartlyTraced& each) {
      if (!each.prediction.predict(each.step, tolerance_, faces[each.position - first])) return false;
      if (each.step == coarsest_step) predict_lengths(map, each.position, positions[each.position - first].parents);
      return true;
    };
    rest.erase(std::remove_if(rest.begin(), rest.end(), is_done), rest.end());
    for (PartlyTraced& each : rest) each.step /= 2;
  }
}

/// Of light that lands on a body, that on its first layer counts as landed, if it comes from the volume.
RayEnd NodeTracer::end_of(const RayBatch& rays, std::size_t ray, const Eigen::Vector3d& origin) const {
  if (!body_ || rays.end[ray] != RayEnd::plate) return rays.end[ray];
  if (!geometry_.crossing(Surface::bounds, true, origin, beam_.direction_at(origin), rays.length[ray]))
    return RayEnd::missed;
  const Eigen::Vector3d back =
      beam_.source ? Eigen::Vector3d((*beam_.source - rays.position[ray]).normalized()) : plate_.normal();
  return body_->absorber(rays.position[ray] + off_body_ * back, back) ? RayEnd::obstacle : RayEnd::plate;
}

/// The face of the volume's box through which the straight end of a ray left it, 0 to 5.
std::uint8_t NodeTracer::exit_face(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const {
  const Eigen::Array3d at = field_.to_index() * position, along = field_.to_index().linear() * direction;
  const Eigen::AlignedBox3d& box = field_.index_bounds();
  const Eigen::Array3d face = (along > 0).select(box.max().array(), box.min().array());
  Eigen::Index axis = 0;
  (along != 0).select((face - at) / along, std::numeric_limits<double>::infinity()).minCoeff(&axis);
  return static_cast<std::uint8_t>(2 * axis + (along[axis] > 0 ? 1 : 0));
}

void NodeTracer::trace_rays(FlowMap& map, std::size_t first, const std::vector<NewPosition>& positions,
                            const std::vector<NodeRay>& rays, std::vector<ExitFaces>& faces) {
  RayBatch batch;
  for (const NodeRay& ray : rays) {
    const Eigen::Vector3d& origin = positions[ray.position - first].origin;
    batch.add(origin, beam_.direction_at(origin), flexibilities_[ray.node]);
  }
  if (memory_)
    memory_->trace(field_, *volume_, geometry_, bending_, batch);
  else
    tensorray::trace(field_, geometry_, bending_, batch);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto& [position, node] = rays[i];
    const std::size_t at = position * nodes() + node;
    map.landings[at] = plate_.to_pixel(place_on(plate_, geometry_, beam_, batch.position[i])).cast<float>();
    map.ends[at] = end_of(batch, i, positions[position - first].origin);
    if (is_range_) faces[position - first][node] = exit_face(batch.position[i], batch.direction[i]);
    if (node % map.check_step == 0)
      map.lengths[position * check_nodes_.size() + node / map.check_step] = static_cast<float>(batch.length[i]);
  }
  rays_ += batch.size();
  tensor_samples_ += batch.tensor_samples;
  ray_steps_ += std::accumulate(batch.steps.begin(), batch.steps.end(), std::uint64_t{0});
}

}  // namespace tensorray
