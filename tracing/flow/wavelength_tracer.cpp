#include "tracing/flow/wavelength_tracer.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "tracing/flow/ray_memory.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

constexpr double prediction_part = 300;  // Landings are predicted to within the tolerance divided by this.
constexpr double off_surface = 1e-4;  // Distance, in sizes of a body, at which it is looked for about its own points.

constexpr std::size_t quarters = 4, quarter_samples = (range_samples - 1) / quarters;

/// The first sample of a quarter, and its last one, which is also the first one of the next quarter.
std::size_t first_of(std::size_t quarter) { return quarter * quarter_samples; }
std::size_t last_of(std::size_t quarter) { return (quarter + 1) * quarter_samples; }

/// Whether the samples from `first` to `last` have some of a quarter's between them.
bool overlaps(std::size_t first, std::size_t last, std::size_t quarter) {
  return first < last_of(quarter) && last > first_of(quarter);
}

/// The value at a sample of the polynomial through `count` samples from `first` on.
struct Stencil {
  std::size_t first = 0;
  std::array<float, 4> weights{};
};

/// Stencils of all samples, for traced samples that are `step` apart.
struct Polynomials {
  std::size_t step, count;
  std::array<Stencil, range_samples> stencils;

  explicit Polynomials(std::size_t distance)
      : step(distance), count(std::min<std::size_t>(4, (range_samples - 1) / distance + 1)) {
    for (std::size_t sample = 0; sample < range_samples; ++sample) {
      // The first of those that are nearest to the sample.
      const std::size_t before = sample / step, last = (range_samples - 1) / step + 1 - count;
      Stencil& stencil = stencils[sample];
      stencil.first = std::min(before > 0 ? before - 1 : 0, last) * step;
      const double t = (static_cast<double>(sample) - static_cast<double>(stencil.first)) / static_cast<double>(step);
      for (std::size_t i = 0; i < count; ++i) {
        double weight = 1;
        for (std::size_t j = 0; j < count; ++j)
          if (j != i) weight *= (t - static_cast<double>(j)) / (static_cast<double>(i) - static_cast<double>(j));
        stencil.weights[i] = static_cast<float>(weight);
      }
    }
  }

  Eigen::Vector2f at(const Eigen::Vector2f* landings, std::size_t sample) const {
    const Stencil& stencil = stencils[sample];
    Eigen::Vector2f sum(0, 0);
    for (std::size_t i = 0; i < count; ++i) sum += stencil.weights[i] * landings[stencil.first + i * step];
    return sum;
  }
};

const Polynomials& polynomials(std::size_t step) {
  static const std::array<Polynomials, 5> all{Polynomials(2), Polynomials(4), Polynomials(8), Polynomials(16),
                                              Polynomials(32)};
  return *std::find_if(all.begin(), all.end(), [&](const Polynomials& each) { return each.step == step; });
}

/// What the polynomials through every `step`-th sample miss at a sample.
Eigen::Vector2f missed(const Eigen::Vector2f* landings, std::size_t step, std::size_t sample) {
  return landings[sample] - polynomials(step).at(landings, sample);
}

}  // namespace

WavelengthPrediction::WavelengthPrediction(FlowMap& map, std::size_t vertex, const Parents& parents,
                                           const Eigen::Array2f& plate)
    : landings_(&map.landings[vertex * range_samples]), ends_(&map.ends[vertex * range_samples]), plate_(plate) {
  for (std::size_t i = 0; i < parents.count; ++i) {
    const std::size_t first = parents.vertices[i] * range_samples;
    const auto ends = map.ends.begin() + static_cast<std::ptrdiff_t>(first);
    if (std::any_of(ends, ends + range_samples, [](RayEnd end) { return end != RayEnd::plate; })) return;
    parents_[i] = &map.landings[first];
  }
  parent_count_ = parents.count;
  for (std::size_t sample = 0; parent_count_ > 0 && sample < range_samples; ++sample) {
    mean_[sample].setZero();
    for (std::size_t i = 0; i < parent_count_; ++i) mean_[sample] += parents_[i][sample];
    mean_[sample] /= static_cast<float>(parent_count_);
  }
}

bool WavelengthPrediction::is_on_plate(std::size_t sample) const {
  return landed(sample) && (landings_[sample].array() >= 0).all() && (landings_[sample].array() <= plate_).all();
}

/// Whether light between this sample and the next one may fall on the plate.
bool WavelengthPrediction::matters(std::size_t sample, std::size_t step) const {
  const std::size_t next = sample + step;
  return (landed(sample) && landed(next)) || is_on_plate(sample) || is_on_plate(next);
}

bool WavelengthPrediction::is_open(std::size_t sample) const {
  for (std::size_t quarter = 0; quarter < quarters; ++quarter)
    if (!is_predicted_[quarter] && first_of(quarter) <= sample && sample <= last_of(quarter)) return true;
  return false;
}

bool WavelengthPrediction::parents_agree(std::size_t step, float tolerance) const {
  for (std::size_t quarter = 0; quarter < quarters; ++quarter)
    if (!parents_agree(quarter, step, tolerance)) return false;
  return true;
}

bool WavelengthPrediction::parents_agree(std::size_t quarter, std::size_t step, float tolerance) const {
  if (parent_count_ == 0) return false;
  // Of two, each differs from the mean as much as the other one.
  for (std::size_t i = parent_count_ == 2 ? 1 : 0; i < parent_count_; ++i) {
    for (std::size_t sample = first_of(quarter); sample <= last_of(quarter); ++sample) {
      const Eigen::Vector2f difference = missed(parents_[i], step, sample) - missed(mean_.data(), step, sample);
      if (!(difference.norm() <= tolerance)) return false;
    }
  }
  return true;
}

bool WavelengthPrediction::is_smooth(std::size_t quarter, std::size_t step, float tolerance) const {
  const std::size_t coarse = 2 * step;
  for (std::size_t sample = step; sample < range_samples; sample += coarse) {
    if (!overlaps(sample - step, sample + step, quarter)) continue;
    if (!matters(sample - step, step) && !matters(sample, step)) continue;
    const Stencil& stencil = polynomials(coarse).stencils[sample];
    for (std::size_t i = 0; i < polynomials(coarse).count; ++i)
      if (!landed(stencil.first + i * coarse)) return false;
    if (!landed(sample) || !(missed(landings_, coarse, sample).norm() <= tolerance)) return false;
  }
  return true;
}

bool WavelengthPrediction::is_smooth_beside_parents(std::size_t quarter, std::size_t step, float tolerance) const {
  for (std::size_t sample = 0; sample < range_samples; sample += step)
    if (!landed(sample)) return false;
  if (!parents_agree(quarter, step, tolerance)) return false;
  for (std::size_t sample = step; sample < range_samples; sample += 2 * step) {
    if (!overlaps(sample - step, sample + step, quarter)) continue;
    const Eigen::Vector2f differs = missed(landings_, 2 * step, sample) - missed(mean_.data(), 2 * step, sample);
    if (!(differs.norm() <= tolerance)) return false;
  }
  return true;
}

/// Between two traced samples of which only one landed, the nearer one counts.
Eigen::Vector2f WavelengthPrediction::between(std::size_t sample, std::size_t step) const {
  const std::size_t before = sample / step * step, after = before + step;
  if (!landed(before) || !landed(after)) return landings_[2 * (sample - before) < step ? before : after];
  const Polynomials& all = polynomials(step);
  for (std::size_t i = 0; i < all.count; ++i)
    if (!landed(all.stencils[sample].first + i * step)) {
      const float part = static_cast<float>(sample - before) / static_cast<float>(step);
      return (1 - part) * landings_[before] + part * landings_[after];
    }
  return all.at(landings_, sample);
}

/// Sets the samples of a quarter that are not traced.
void WavelengthPrediction::set(std::size_t quarter, std::size_t step, bool beside_parents) {
  for (std::size_t sample = first_of(quarter); sample <= last_of(quarter); ++sample) {
    if (sample % step == 0) continue;
    const std::size_t before = sample / step * step;
    ends_[sample] = ends_[2 * (sample - before) < step ? before : before + step];
    landings_[sample] = between(sample, step);
    if (beside_parents) landings_[sample] += missed(mean_.data(), step, sample);
  }
}

bool WavelengthPrediction::predict(std::size_t step, float tolerance) {
  if (step == 1) return true;
  std::array<bool, quarters> is_ready{}, beside_parents{};
  for (std::size_t quarter = 0; quarter < quarters; ++quarter) {
    if (is_predicted_[quarter]) continue;
    beside_parents[quarter] = is_smooth_beside_parents(quarter, step, tolerance);
    // Three samples do not tell by themselves how smooth landings are.
    is_ready[quarter] = beside_parents[quarter] || (step <= quarter_samples && is_smooth(quarter, step, tolerance));
  }
  const auto is_true = [](bool each) { return each; };
  if (step > quarter_samples && !std::all_of(is_ready.begin(), is_ready.end(), is_true)) return false;
  for (std::size_t quarter = 0; quarter < quarters; ++quarter) {
    if (!is_ready[quarter]) continue;
    set(quarter, step, beside_parents[quarter]);
    is_predicted_[quarter] = true;
  }
  return std::all_of(is_predicted_.begin(), is_predicted_.end(), is_true);
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
  if (settings.memory && !beam.source && RayMemory::serves(field, geometry, beam.direction, bending)) {
    memory_ = settings.memory;
    Surfaces volume = geometry.surfaces();
    volume.plate.reset();
    volume_.emplace(std::move(volume));
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

/// Sets the lengths between those of three samples: as far from the mean of two as those of the parents are.
void WavelengthTracer::predict_lengths(FlowMap& map, std::size_t vertex, const Parents& parents) const {
  const auto missed = [&](std::size_t of, std::size_t check) {
    const float* lengths = &map.lengths[of * map.checks()];
    return lengths[check] - (lengths[check - 1] + lengths[check + 1]) / 2;
  };
  for (std::size_t check = 1; check < map.checks(); check += 2) {
    float& length = map.lengths[vertex * map.checks() + check];
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
    // Every `step`-th sample of each vertex; after the first time, only those that are not known yet. Rays of one
    // sample follow each other: those of neighbouring vertices cross the same cells of the field.
    rays.clear();
    for (std::size_t sample = 0; sample < range_samples; ++sample)
      for (const auto& [vertex, step, prediction] : rest)
        if (is_first ? sample % step == 0 : sample % (2 * step) == step && prediction.is_open(sample))
          rays.push_back({vertex, sample});
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
      map.lengths[of.index * map.checks() + sample / map.check_step] = static_cast<float>(batch.length[i]);
  }
  rays_ += batch.size();
  tensor_samples_ += batch.tensor_samples;
  ray_steps_ += std::accumulate(batch.steps.begin(), batch.steps.end(), std::uint64_t{0});
}

}  // namespace tensorray
