#include "integrators/scene/field_region.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "tracing/trace/trace.h"

namespace tensorray {

using Eigen::Vector3d;

namespace {
constexpr double face_thickness = 1e-3;  // Voxels: positions at the end of a ray have single precision.
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
  constexpr double infinite = std::numeric_limits<double>::infinity();
  double enters = 0, leaves = infinite;
  for (int axis = 0; axis < 3; ++axis) {
    if (along[axis] == 0) {
      if (from[axis] < box.min()[axis] || from[axis] > box.max()[axis]) return infinite;
      continue;
    }
    const double a = (box.min()[axis] - from[axis]) / along[axis], b = (box.max()[axis] - from[axis]) / along[axis];
    enters = std::max(enters, std::min(a, b));
    leaves = std::min(leaves, std::max(a, b));
  }
  return leaves - enters > rounding_ ? enters : infinite;
}

/// Where a way is followed from. With obstacles this is a little behind the entry into the volume, so that the way does
/// not meet the surface on which it starts.
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

/// Follows some ways of each group and all that are in none; then the rest of groups that cannot be interpolated. Each
/// is one call of `trace`.
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

/// If radiance is constant, a photon's power changes by e^Λ: the inverse of the factor on radiance if power is
/// constant.
void FieldRegion::trace_importance(std::vector<BentRay>& ways) const {
  follow(1, settings_.conserve == Conserve::radiance, ways);
  for (BentRay& way : ways) way.arrives = way.arrives && std::isfinite(way.radiance_scale);
}

}  // namespace tensorray
