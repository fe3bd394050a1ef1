#include "tracing/scale/auto_scale.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <tbb/parallel_for.h>

#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr double wanted_part = 0.85;   // Of the greatest AutoScale::shown.
constexpr double tangled_part = 0.75;  // A scale that shows less than this part of a lesser one tangles light.
constexpr double max_turn = 0.4;       // AutoScale::median_turn; light that turns more leaves the plate.
constexpr double visible_turn = 0.15;
constexpr double first_turn = 0.015;  // No ray turns by more at the first scale, radians.
// A scale that shows less than this, with less turn, is too small. A few rays tell: one of so many.
constexpr double weak_shown = 0.1, weak_turn = 0.05;
constexpr std::size_t few = 4;
constexpr double narrow = 0.25;        // A silhouette that is narrower, as a part of its length, is worth less.
constexpr double least_better = 1.02;  // A direction is better than one before it if it is worth more than this.
constexpr double min_shown = 1e-6, min_gain = 1.5;  // Less may be rounding, or not be what grows with the scale.
constexpr int doublings = 30, halvings = 8;
constexpr int patience = 12;             // Doublings after which light that has not turned at all will not.
constexpr double smallest_turn = 1e-7;   // Radians; a ray that turns less counts as straight.
constexpr double plane_distance = 0.25;  // Of the plane, behind the volume, in depths of the volume.
constexpr double min_slope = 0.1;        // Cosine between light and the plane's normal, for light that lands.
constexpr std::uint64_t probe_count = 1024;
constexpr std::size_t probe_batch = 64;  // Rays that one thread traces together.

/// Probe rays and the plane behind the volume on which they land.
struct ProbeBeam {
  const Beam& beam;
  std::vector<Vector3d> origins;
  double plane;  // Its place along the light.
};

ProbeBeam probe_beam(const TensorField& field, const Beam& beam) {
  ProbeBeam probes{beam, {}, 0};
  const BeamSampler sampler(beam, BeamPattern::stratified, probe_count, 0);
  Emission emission;
  for (std::uint64_t i = 0; i < sampler.candidates(); ++i)
    if (sampler.sample(i, emission)) probes.origins.push_back(emission.origin);
  const auto [near, far] = depth_range(field, Vector3d::Zero(), beam.direction);
  probes.plane = far + plane_distance * (far - near);
  return probes;
}

/// By how much the light about a ray is spread where it lands: ln |det ∂landing/∂start|. 0 if it does not land.
double log_area(const ProbeBeam& probes, const RayBatch& batch, std::size_t i) {
  const Beam& beam = probes.beam;
  const Vector3d& V = batch.direction[i];
  const double slope = V.dot(beam.direction);
  if (slope < min_slope) return 0;
  const RayDifferential& d = batch.differentials[i];
  const double ahead = (probes.plane - batch.position[i].dot(beam.direction)) / slope;
  const Eigen::Matrix<double, 3, 2> moved = d.position + ahead * d.direction;
  const Eigen::Matrix<double, 3, 2> landed = moved - V * (beam.direction.transpose() * moved) / slope;
  Eigen::Matrix2d jacobian;
  jacobian << beam.right.transpose() * landed, beam.up.transpose() * landed;
  const double area = std::abs(jacobian.determinant());
  return std::isfinite(area) ? std::log(std::max(area, 1e-300)) : 0;
}

/// Sets all values but the scale.
/// @param turns    Of all rays.
/// @param changes  |ln| of the change of area, by ray.
AutoScale summary(double scale, std::vector<double> turns, const std::vector<double>& changes) {
  AutoScale result;
  result.scale = scale;
  const auto rays = static_cast<double>(changes.size());
  turns.erase(std::remove_if(turns.begin(), turns.end(), [](double turn) { return turn < smallest_turn; }),
              turns.end());
  if (turns.empty()) return result;
  result.bent_fraction = static_cast<double>(turns.size()) / rays;
  result.greatest_turn = *std::max_element(turns.begin(), turns.end());
  const auto median = turns.begin() + static_cast<std::ptrdiff_t>(turns.size() / 2);
  std::nth_element(turns.begin(), median, turns.end());
  result.median_turn = *median;
  for (const double change : changes) result.shown += change * std::exp(1 - change) / rays;
  return result;
}

/// @param each  Only every so many rays are traced.
AutoScale probe(const TensorField& field, const Geometry& geometry, const ProbeBeam& probes, double scale,
                const Progress& progress, std::size_t each = 1) {
  BendingSettings settings;
  settings.scale = scale;
  settings.method = BendingMethod::splitting;
  settings.step = field.is_cubic() ? 1 : 0.5;  // A fixed step, because the splitting method is stable at any scale.
  const Beam& beam = probes.beam;
  const std::size_t rays = (probes.origins.size() + each - 1) / each;
  RayDifferential start;
  start.position << beam.right, beam.up;
  std::vector<double> turns(rays), changes(rays);
  const std::size_t batches = (rays + probe_batch - 1) / probe_batch;
  tbb::parallel_for(std::size_t{0}, batches, [&](std::size_t task) {
    if (progress.cancelled) throw Cancelled();
    const std::size_t first = task * probe_batch, count = std::min(probe_batch, rays - first);
    RayBatch batch;
    for (std::size_t i = 0; i < count; ++i)
      batch.add(probes.origins[(first + i) * each], beam.direction, probe_flexibility);
    batch.differentials.assign(count, start);
    trace(field, geometry, settings, batch);
    for (std::size_t i = 0; i < count; ++i) {
      if (batch.end[i] != RayEnd::plate && batch.end[i] != RayEnd::missed) continue;  // It was not followed.
      const Vector3d& V = batch.direction[i];
      turns[first + i] = std::atan2(beam.direction.cross(V).norm(), beam.direction.dot(V));
      changes[first + i] = std::abs(log_area(probes, batch, i));
    }
  });
  return summary(scale, std::move(turns), changes);
}

/// Doubles a scale while a few rays show that it is far too small: that they show little, but more each time.
double last_weak_scale(const TensorField& field, const Geometry& geometry, const ProbeBeam& probes, double scale,
                       const Progress& progress) {
  double shown = min_shown;
  for (int i = 0; i < doublings; ++i, scale *= 2) {
    const AutoScale by_few = probe(field, geometry, probes, scale, progress, few);
    const bool is_weak = by_few.shown < weak_shown && by_few.median_turn < weak_turn;
    if (!is_weak || by_few.shown < min_gain * shown) return i > 0 ? scale / 2 : scale;
    shown = by_few.shown;
  }
  return scale;
}

/// For light that only turns: the first scale that turns it visibly, or the one that turns it most.
AutoScale turned(const std::vector<AutoScale>& tried) {
  AutoScale most;
  for (const AutoScale& each : tried) {
    if (each.median_turn > most.median_turn) most = each;
    if (most.median_turn >= visible_turn) break;
  }
  return most;
}

/// As choose_scale. @param each  As for `probe`.
AutoScale find_scale(const TensorField& field, const Geometry& geometry, const Beam& beam, const Progress& progress,
                     std::size_t each) {
  const double norm = field.max_norm();
  if (norm == 0) return {};
  const ProbeBeam probes = probe_beam(field, beam);
  const double depth = (field.to_world().linear() * field.index_bounds().sizes()).norm();
  // No ray turns by more than s‖T‖ times its length.
  const double first = first_turn / (probe_flexibility * norm * depth);
  double scale = last_weak_scale(field, geometry, probes, first, progress);
  std::vector<AutoScale> tried;
  AutoScale best;
  for (int i = 0; i < doublings; ++i, scale *= 2) {
    tried.push_back(probe(field, geometry, probes, scale, progress, each));
    if (tried.size() > 1 && tried.back().median_turn > max_turn) break;
    if (tried.back().shown > best.shown) best = tried.back();
    if (tried.back().shown < tangled_part * best.shown) break;
    if (i >= patience && tried.back().bent_fraction == 0) break;
  }
  if (best.shown == 0) return turned(tried);
  const double wanted = wanted_part * best.shown;
  AutoScale low, high;
  for (const AutoScale& next : tried) {
    low = high;
    high = next;
    if (high.shown >= wanted) break;
  }
  for (int i = 0; i < halvings && low.shown > 0; ++i) {
    const AutoScale middle = probe(field, geometry, probes, (low.scale + high.scale) / 2, progress, each);
    (middle.shown < wanted ? low : high) = middle;
  }
  return high;
}

/// How much of a picture a silhouette can fill, as far as its shape tells: less than 1 for a strip.
double fill_of(const Beam& beam) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : beam.aperture) box.extend(corner);
  return std::min(1.0, box.sizes().minCoeff() / (narrow * box.sizes().maxCoeff()));
}

/// Along the axes first, then along the diagonals of faces, then of the cube.
std::vector<Vector3d> axes_and_diagonals() {
  std::vector<Vector3d> directions;
  for (int parts = 1; parts <= 3; ++parts)
    for (const double sign : {-1.0, 1.0})
      for (int n = 26; n > 13; --n) {  // One of each pair of opposite ones.
        const Vector3d direction = sign * Vector3d(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        if (direction.cwiseAbs().sum() == parts) directions.push_back(direction.normalized());
      }
  return directions;
}

}  // namespace

AutoScale choose_scale(const TensorField& field, const Geometry& geometry, const Beam& beam, const Progress& progress) {
  return find_scale(field, geometry, beam, progress, 1);
}

AutoScale judge_scale(const TensorField& field, const Geometry& geometry, const Beam& beam, double scale,
                      double flexibility, const Progress& progress) {
  const double strength = scale * flexibility / probe_flexibility;
  AutoScale result = probe(field, geometry, probe_beam(field, beam), strength, progress);
  result.scale = scale;
  return result;
}

std::vector<AutoDirection> rank_directions(const TensorField& field, const Geometry& geometry, const Vector3d& up,
                                           const Progress& progress) {
  std::vector<AutoDirection> ranked;
  for (const Vector3d& direction : axes_and_diagonals()) {
    const Beam beam = silhouette_beam(field.corners(), direction, up);
    const AutoScale scale = find_scale(field, geometry, beam, progress, few);
    ranked.push_back({direction, scale, scale.shown * fill_of(beam)});
  }
  // Rounding does not decide between directions that symmetry makes equal: the first of them wins.
  const double step = std::log(least_better);
  const auto order = [&](const AutoDirection& d) { return d.worth > 0 ? std::floor(std::log(d.worth) / step) : -1e9; };
  std::stable_sort(ranked.begin(), ranked.end(),
                   [&](const AutoDirection& a, const AutoDirection& b) { return order(a) > order(b); });
  return ranked;
}

AutoDirection choose_direction(const TensorField& field, const Geometry& geometry, const Vector3d& up,
                               const Progress& progress) {
  const AutoDirection best = rank_directions(field, geometry, up, progress).front();
  return best.worth > 0 ? best : AutoDirection{-Vector3d::UnitZ(), {}};
}

}  // namespace tensorray
