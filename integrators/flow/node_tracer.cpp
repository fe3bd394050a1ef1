#include "integrators/flow/node_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "integrators/flow/ray_memory.h"

namespace tensorray {
namespace {

constexpr std::size_t range_nodes = 33, first_step = 8;  // 5 nodes come first.
constexpr double off_surface = 1e-4;  // Distance, in sizes of a body, at which it is looked for about its own points.
constexpr float gain_of_first =
    8;  // The error of the cubic through the first nodes, as a part of that of the parabola.
constexpr float gain_of_halving = 8;  // Halving the distance of nodes: 16 for smooth landings; less, to be safe.

/// The polynomial through the `count` nodes from `first` on, `step` apart, at node `at`.
Eigen::Vector2f interpolated(const Eigen::Vector2f* landings, std::size_t first, std::size_t step, int count,
                             std::size_t at) {
  const float t = (static_cast<float>(at) - static_cast<float>(first)) / static_cast<float>(step);
  Eigen::Vector2f sum(0, 0);
  for (int i = 0; i < count; ++i) {
    float weight = 1;
    for (int j = 0; j < count; ++j)
      if (j != i) weight *= (t - static_cast<float>(j)) / static_cast<float>(i - j);
    sum += weight * landings[first + static_cast<std::size_t>(i) * step];
  }
  return sum;
}

/// The first of the four nodes, `step` apart, that are nearest to `node`.
std::size_t first_of_cubic(std::size_t step, std::size_t node) {
  const std::size_t last = (range_nodes - 1) / step - 3, before = node / step;
  return std::min(before > 0 ? before - 1 : 0, last) * step;
}

/// The landings of a position that are traced so far: every `step`-th node.
struct TracedNodes {
  Eigen::Vector2f* landings;
  RayEnd* ends;
  std::size_t step;
  Eigen::Array2f plate;  // Width and height, pixels.

  bool landed(std::size_t node) const { return ends[node] == RayEnd::plate; }
  bool is_on_plate(std::size_t node) const {
    return landed(node) && (landings[node].array() >= 0).all() && (landings[node].array() <= plate).all();
  }

  /// Whether light between this node and the next one may fall on the plate.
  bool matters(std::size_t node) const {
    const std::size_t next = node + step;
    return (landed(node) && landed(next)) || is_on_plate(node) || is_on_plate(next);
  }

  /// The distance of a node from what the nodes of twice the step predict; infinite if one of these did not land.
  float deviation(std::size_t node) const {
    const bool first = step == first_step;
    const int count = first ? 3 : 4;
    const std::size_t from = first ? 0 : first_of_cubic(2 * step, node);
    for (int i = 0; i < count; ++i)
      if (!landed(from + static_cast<std::size_t>(i) * 2 * step)) return std::numeric_limits<float>::infinity();
    return (landings[node] - interpolated(landings, from, 2 * step, count, node)).norm();
  }

  /// Whether the nodes between the traced ones can be interpolated to within `tolerance` where this matters.
  bool is_smooth(double tolerance) const {
    const float gain = step == first_step ? gain_of_first : gain_of_halving;
    for (std::size_t node = step; node < range_nodes; node += 2 * step) {
      const bool matters_here = matters(node - step) || matters(node);
      if (matters_here && !(landed(node) && deviation(node) / gain <= tolerance)) return false;
    }
    return true;
  }

  /// Sets the nodes between the traced ones.
  void fill() const {
    for (std::size_t node = 0; node < range_nodes; ++node) {
      if (node % step == 0) continue;
      const std::size_t before = node / step * step, nearest = 2 * (node - before) < step ? before : before + step;
      ends[node] = ends[nearest];
      landings[node] = landings[nearest];
      if (landed(before) && landed(before + step)) landings[node] = between(before, node);
    }
  }

 private:
  /// Cubic if four nodes about `node` landed, else linear.
  Eigen::Vector2f between(std::size_t before, std::size_t node) const {
    const std::size_t from = first_of_cubic(step, node);
    for (std::size_t i = 0; i < 4; ++i)
      if (!landed(from + i * step)) return interpolated(landings, before, step, 2, node);
    return interpolated(landings, from, step, 4, node);
  }
};

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
      tolerance_(settings.tolerance / 16),
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

void NodeTracer::trace(const std::vector<Eigen::Vector3d>& origins, Eigen::Vector2f* landings, RayEnd* ends,
                       float* lengths) {
  std::vector<std::size_t> which(origins.size());
  std::iota(which.begin(), which.end(), std::size_t{0});
  if (!is_range_) return trace_nodes(origins, which, 0, 1, landings, ends, lengths);
  trace_nodes(origins, which, 0, first_step, landings, ends, lengths);
  for (std::size_t step = first_step; step > 1; step /= 2) {
    std::vector<std::size_t> rough;
    for (const std::size_t i : which) {
      const TracedNodes traced{landings + i * nodes(), ends + i * nodes(), step, plate_.resolution.cast<float>()};
      if (traced.is_smooth(tolerance_))
        traced.fill();
      else
        rough.push_back(i);
    }
    if (rough.empty()) return;
    which = std::move(rough);
    trace_nodes(origins, which, step / 2, step, landings, ends, nullptr);
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

void NodeTracer::trace_nodes(const std::vector<Eigen::Vector3d>& origins, const std::vector<std::size_t>& which,
                             std::size_t first, std::size_t step, Eigen::Vector2f* landings, RayEnd* ends,
                             float* lengths) {
  RayBatch batch;
  // Light of one node from neighbouring positions crosses the same cells of the field.
  for (std::size_t node = first; node < nodes(); node += step)
    for (const std::size_t i : which) batch.add(origins[i], beam_.direction_at(origins[i]), flexibilities_[node]);
  if (memory_)
    memory_->trace(field_, *volume_, geometry_, bending_, batch);
  else
    tensorray::trace(field_, geometry_, bending_, batch);
  std::size_t ray = 0;
  for (std::size_t node = first; node < nodes(); node += step)
    for (const std::size_t i : which) {
      landings[i * nodes() + node] =
          plate_.to_pixel(place_on(plate_, geometry_, beam_, batch.position[ray])).cast<float>();
      ends[i * nodes() + node] = end_of(batch, ray, origins[i]);
      if (lengths) lengths[i * check_nodes_.size() + (node - first) / step] = static_cast<float>(batch.length[ray]);
      ++ray;
    }
  rays_ += batch.size();
  tensor_samples_ += batch.tensor_samples;
  ray_steps_ += std::accumulate(batch.steps.begin(), batch.steps.end(), std::uint64_t{0});
}

}  // namespace tensorray
