#include "tracing/flow/wavelength_tracer.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

constexpr double prediction_part = 2;  // Middles of gaps are predicted to within the tolerance divided by this, ...
constexpr float of_last_gaps = 4;      // ... and to so many times of that where halves have a single sample between.
constexpr double off_surface = 1e-4;   // Distance, in sizes of a body, at which it is looked for about its own points.

constexpr int last_sample = range_samples - 1;

}  // namespace

WavelengthPrediction::WavelengthPrediction(FlowMap& map, std::size_t vertex, const Eigen::Array2f& plate,
                                           float tolerance)
    : landings_(&map.landings[vertex * range_samples]),
      ends_(&map.ends[vertex * range_samples]),
      plate_(plate),
      tolerance_(tolerance),
      wanted_{0, last_sample / 2, last_sample} {
  for (const int sample : wanted_) is_traced_[sample] = true;
  divide({{0, last_sample / 2}, {last_sample / 2, last_sample}});
}

/// The polynomial through the four nearest traced samples whose light lands, two on each side if there are as many;
/// none beyond a traced one whose light does not land.
Eigen::Vector2f WavelengthPrediction::predicted(int sample) const {
  const auto along = [&](int step, std::array<int, 4>& found) {
    int count = 0;
    for (int i = sample + step; i >= 0 && i <= last_sample && count < 4; i += step) {
      if (!is_traced_[i]) continue;
      if (!landed(i)) break;
      found[count++] = i;
    }
    return count;
  };
  std::array<int, 4> nodes, after;
  const int left = along(-1, nodes), right = along(1, after);
  const int from_left = std::min(left, 4 - std::min(right, 2)), from_right = std::min(right, 4 - from_left);
  std::copy_n(after.begin(), from_right, nodes.begin() + from_left);
  Eigen::Vector2f sum(0, 0);
  for (int i = 0; i < from_left + from_right; ++i) {
    float weight = 1;
    for (int j = 0; j < from_left + from_right; ++j)
      if (j != i) weight *= static_cast<float>(sample - nodes[j]) / static_cast<float>(nodes[i] - nodes[j]);
    sum += weight * landings_[nodes[i]];
  }
  return sum;
}

bool WavelengthPrediction::is_on_plate(int sample) const {
  return landed(sample) && (landings_[sample].array() >= 0).all() && (landings_[sample].array() <= plate_).all();
}

/// Wants the middles of gaps.
void WavelengthPrediction::divide(std::vector<Gap> gaps) {
  open_ = std::move(gaps);
  for (const Gap& gap : open_) wanted_.push_back(gap.middle());
}

void WavelengthPrediction::go_on() {
  for (const int sample : wanted_) is_traced_[sample] = true;
  wanted_.clear();
  std::vector<Gap> rest;
  for (const Gap& gap : open_) {
    const int middle = gap.middle();
    const float bound = gap.to - gap.from > 4 ? tolerance_ : of_last_gaps * tolerance_;
    const bool is_smooth = landed(middle) && (predicted(middle) - landings_[middle]).norm() <= bound;
    for (const auto& [from, to] : {Gap{gap.from, middle}, Gap{middle, gap.to}}) {
      const bool is_known = landed(from) && landed(to) ? is_smooth : !is_on_plate(from) && !is_on_plate(to);
      if (to - from > 1 && !is_known) rest.push_back({from, to});
    }
  }
  divide(std::move(rest));
  if (wanted_.empty()) predict_rest();
}

/// Between two traced samples of which only one landed, the nearer one counts.
void WavelengthPrediction::predict_rest() {
  int before = 0;
  for (int after = 1; after <= last_sample; ++after) {
    if (!is_traced_[after]) continue;
    for (int sample = before + 1; sample < after; ++sample) {
      const int nearest = 2 * (sample - before) < after - before ? before : after;
      ends_[sample] = ends_[nearest];
      landings_[sample] = landed(before) && landed(after) ? predicted(sample) : landings_[nearest];
    }
    before = after;
  }
}

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
  if (geometry.surfaces().body) {
    Surfaces alone;
    alone.bounds = geometry.surfaces().bounds;
    alone.body = geometry.surfaces().body;
    const double off = off_surface * alone.body->bounds().diagonal().norm();
    body_.emplace(Body{Geometry(std::move(alone)), off});
  }
  if (!settings.side_light) sides_.emplace(field, beam.direction);
}

void WavelengthTracer::trace(FlowMap& map, const std::vector<NewVertex>& vertices) {
  std::vector<SampleRay> rays;
  if (!is_range_) {
    for (std::size_t sample = 0; sample < wavelengths(); ++sample)
      for (std::size_t i = 0; i < vertices.size(); ++i) rays.push_back({i, sample});
    return trace_rays(map, vertices, rays);
  }
  std::vector<PartlyTraced> rest;
  for (std::size_t i = 0; i < vertices.size(); ++i)
    rest.push_back({i, {map, vertices[i].index, plate_.resolution.cast<float>(), tolerance_}});
  while (!rest.empty()) {
    rays.clear();
    for (const auto& [vertex, prediction] : rest)
      for (const int sample : prediction.wanted()) rays.push_back({vertex, static_cast<std::size_t>(sample)});
    // Rays of one sample follow each other: those of neighbouring vertices cross the same cells of the field.
    std::stable_sort(rays.begin(), rays.end(), [](const auto& a, const auto& b) { return a.sample < b.sample; });
    trace_rays(map, vertices, rays);
    const auto is_done = [](PartlyTraced& each) {
      each.prediction.go_on();
      return each.prediction.wanted().empty();
    };
    rest.erase(std::remove_if(rest.begin(), rest.end(), is_done), rest.end());
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
  tensorray::trace(field_, geometry_, bending_, batch);
  if (sides_) sides_->mark(batch);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto& [vertex, sample] = rays[i];
    const NewVertex& of = vertices[vertex];
    const std::size_t at = of.index * wavelengths() + sample;
    map.landings[at] = plate_.to_pixel(place_on(plate_, geometry_, beam_, batch.position[i])).cast<float>();
    map.ends[at] = end_of(batch, i, of.origin);
    if (sample % map.check_step == 0)
      map.lengths[of.index * map.checks() + sample / map.check_step] = static_cast<float>(batch.length[i]);
  }
  rays_ += batch.size();
  tensor_samples_ += batch.tensor_samples;
  ray_steps_ += std::accumulate(batch.steps.begin(), batch.steps.end(), std::uint64_t{0});
}

}  // namespace tensorray
