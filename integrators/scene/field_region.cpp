#include "integrators/scene/field_region.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/constants.h"
#include "base/geometry/box.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr double face_thickness = 1e-3;  // Voxels: positions at the end of a ray have single precision.
constexpr std::size_t fewest_ways = 6;
constexpr double max_change = 0.01;  // Of the jacobian, as predicted for the check.

bool starts_alike(const BentRay& a, const BentRay& b) {
  return a.position == b.position && a.direction == b.direction && a.place == b.place && a.tolerance == b.tolerance;
}

void choose_nodes(BandGroup& group) {
  const std::size_t count = 3 + (group.count - 1) / 8;  // 3 for 8 ways, 4 for 16, 6 for 32.
  std::size_t widest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double turn = pi * static_cast<double>(i) / static_cast<double>(count - 1);
    const double place = static_cast<double>(group.count - 1) * (1 - std::cos(turn)) / 2;
    group.nodes.push_back(group.first + static_cast<std::size_t>(std::round(place)));
    if (i == 0 || group.nodes[i] - group.nodes[i - 1] <= widest) continue;
    widest = group.nodes[i] - group.nodes[i - 1];
    group.check = group.nodes[i - 1] + widest / 2;
  }
}

/// What is interpolated of a way.
struct WayEnd {
  Vector3d position = Vector3d::Zero();
  Vector3d direction = Vector3d::Zero();
  double log_jacobian = 0;
};

/// @param nodes  Indices of ways. The abscissa is the number of the band, as a ray has one place in all its bands.
WayEnd interpolated(const std::vector<std::size_t>& nodes, const std::vector<BentRay>& ways, int band) {
  WayEnd sum;
  for (const std::size_t node : nodes) {
    double weight = 1;
    for (const std::size_t other : nodes)
      if (other != node) weight *= static_cast<double>(band - ways[other].band) / (ways[node].band - ways[other].band);
    sum.position += weight * ways[node].position;
    sum.direction += weight * ways[node].direction;
    sum.log_jacobian += weight * std::log(ways[node].jacobian);
  }
  sum.direction.normalize();
  return sum;
}

}  // namespace

FieldRegion::FieldRegion(const TensorField& field, const Geometry& geometry, FieldViewSettings settings)
    : field_(field),
      geometry_(geometry),
      settings_(std::move(settings)),
      rounding_(1e-9 * field.world_box().diagonal().norm()) {}

/// Clips the ray against the box in index space, where its parameter stays the distance in the world.
double FieldRegion::entry(const Vector3d& origin, const Vector3d& direction) const {
  const Eigen::AlignedBox3d& box = field_.index_bounds();
  const Vector3d from = field_.to_index() * origin, along = field_.to_index().linear() * direction;
  const auto [first, last] = passage(box, from, along).value_or(std::pair(0.0, 0.0));
  const double enters = std::max(0.0, first);
  return last - enters > rounding_ ? enters : std::numeric_limits<double>::infinity();
}

/// Where a way is followed from. With obstacles, a little behind the entry, so as not to meet the surface it starts on.
Vector3d FieldRegion::start_of(const BentRay& way) const {
  if (geometry_.surfaces().obstacles.empty()) return way.position;
  const double before = entry(way.position, way.direction);
  return way.position + ((std::isinf(before) ? 0 : before) + 2 * geometry_.margin()) * way.direction;
}

/// @param sign   Of the flexibility: 1 for light, −1 for light that is followed back.
/// @param scales  Whether to set radiance_scale to the factor along the ray; otherwise it is 1.
void FieldRegion::follow(double sign, bool scales, std::vector<BentRay>& ways) const {
  RayBatch& rays = memory_.local();
  rays.clear();
  for (const BentRay& way : ways)
    rays.add(start_of(way), way.direction, sign * settings_.flexibility(way.band, way.place));
  if (sign < 0) ways_ += rays.size();
  rays.wants_log_radiance_scale = true;
  rays.tensor_samples = 0;
  trace(field_, geometry_, settings_.bending, rays);
  tensor_samples_ += rays.tensor_samples;
  steps_ += std::accumulate(rays.steps.begin(), rays.steps.end(), std::uint64_t{0});
  for (std::size_t i = 0; i < ways.size(); ++i) {
    BentRay& way = ways[i];
    const RayEnd end = rays.end[i];
    way.position = rays.position[i];
    way.direction = rays.direction[i];
    way.arrives = end == RayEnd::missed || end == RayEnd::obstacle;
    way.on_surface = end == RayEnd::obstacle;
    way.radiance_scale = scales && way.arrives ? std::exp(rays.log_radiance_scale[i]) : 1;
    way.jacobian = std::exp(-sign * rays.log_radiance_scale[i]);
    if (sign < 0) ++ends_[static_cast<std::size_t>(end)];
  }
}

void FieldRegion::trace_radiance(std::vector<BentRay>& ways) const {
  std::vector<BandGroup> groups;
  if (geometry_.surfaces().obstacles.empty()) groups = interpolation_groups(ways);
  if (groups.empty())
    follow(-1, settings_.conserve == Conserve::power, ways);
  else
    follow_groups(std::move(groups), ways);
  for (BentRay& way : ways) {
    if (way.arrives && settings_.max_radiance_scale > 0 && !(way.radiance_scale <= settings_.max_radiance_scale)) {
      way.radiance_scale = settings_.max_radiance_scale;
      ++limited_;
    }
    way.arrives = way.arrives && std::isfinite(way.radiance_scale);
  }
}

/// Follows back the ways with these indices.
void FieldRegion::follow_some(const std::vector<std::size_t>& which, std::vector<BentRay>& ways) const {
  std::vector<BentRay> some;
  for (const std::size_t i : which) some.push_back(ways[i]);
  follow(-1, settings_.conserve == Conserve::power, some);
  for (std::size_t k = 0; k < which.size(); ++k) ways[which[k]] = some[k];
}

/// Follows some ways of each group and all that are in none; then, in one call, groups that cannot be interpolated.
void FieldRegion::follow_groups(std::vector<BandGroup> groups, std::vector<BentRay>& ways) const {
  std::vector<std::size_t> wanted;
  std::vector<Vector3d> starts;
  std::size_t next = 0;
  for (const BandGroup& group : groups) {
    for (; next < group.first; ++next) wanted.push_back(next);
    for (; next < group.first + group.count; ++next)
      if (group.is_traced(next)) wanted.push_back(next);
    starts.push_back(ways[group.first].position);
  }
  for (; next < ways.size(); ++next) wanted.push_back(next);
  follow_some(wanted, ways);

  wanted.clear();
  for (std::size_t k = 0; k < groups.size(); ++k) {
    const BandGroup& group = groups[k];
    if (end_alike(group, ways) && is_predictable(group, ways, starts[k])) {
      interpolate(group, ways);
      for (std::size_t i = group.first; i < group.first + group.count; ++i)
        ways[i].radiance_scale = settings_.conserve == Conserve::power ? ways[i].jacobian : 1;
    } else {
      for (std::size_t i = group.first; i < group.first + group.count; ++i)
        if (!group.is_traced(i)) wanted.push_back(i);
    }
  }
  follow_some(wanted, ways);
}

/// Whether the traced ways of a group leave the volume by one face of its box.
bool FieldRegion::end_alike(const BandGroup& group, const std::vector<BentRay>& ways) const {
  const int face = face_at(ways[group.check].position);
  const auto leaves = [&](std::size_t i) {
    return ways[i].arrives && !ways[i].on_surface && face_at(ways[i].position) == face;
  };
  return face >= 0 && leaves(group.check) && std::all_of(group.nodes.begin(), group.nodes.end(), leaves);
}

/// The number of the box's face on which a position lies; −1: none.
int FieldRegion::face_at(const Vector3d& position) const {
  const Vector3d at = field_.to_index() * position;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(at[axis] - field_.index_bounds().min()[axis]) < face_thickness) return 2 * axis;
    if (std::abs(at[axis] - field_.index_bounds().max()[axis]) < face_thickness) return 2 * axis + 1;
  }
  return -1;
}

/// If radiance is constant, a photon's power changes by e^Λ: the inverse of the factor on radiance otherwise.
void FieldRegion::trace_importance(std::vector<BentRay>& ways) const {
  follow(1, settings_.conserve == Conserve::radiance, ways);
  for (BentRay& way : ways) way.arrives = way.arrives && std::isfinite(way.radiance_scale);
}

bool BandGroup::is_traced(std::size_t way) const {
  return way == check || std::binary_search(nodes.begin(), nodes.end(), way);
}

std::vector<BandGroup> interpolation_groups(const std::vector<BentRay>& ways) {
  std::vector<BandGroup> groups;
  for (std::size_t first = 0, last = 0; first < ways.size(); first = last) {
    while (last < ways.size() && starts_alike(ways[first], ways[last])) ++last;
    if (!(ways[first].tolerance > 0) || last - first < fewest_ways) continue;
    groups.push_back({first, last - first, {}, 0});
    choose_nodes(groups.back());
  }
  return groups;
}

bool is_predictable(const BandGroup& group, const std::vector<BentRay>& ways, const Vector3d& start) {
  const BentRay& check = ways[group.check];
  const WayEnd predicted = interpolated(group.nodes, ways, check.band);
  const Vector3d off = predicted.position - check.position;
  return off.norm() <= check.tolerance * (check.position - start).norm() &&
         (predicted.direction - check.direction).norm() <= check.tolerance &&
         std::abs(predicted.log_jacobian - std::log(check.jacobian)) <= max_change;
}

void interpolate(const BandGroup& group, std::vector<BentRay>& ways) {
  std::vector<std::size_t> traced = group.nodes;
  traced.push_back(group.check);
  for (std::size_t i = group.first; i < group.first + group.count; ++i) {
    if (group.is_traced(i)) continue;
    const WayEnd end = interpolated(traced, ways, ways[i].band);
    ways[i].position = end.position;
    ways[i].direction = end.direction;
    ways[i].jacobian = std::exp(end.log_jacobian);
    ways[i].arrives = true;
    ways[i].on_surface = false;
  }
}

}  // namespace tensorray
