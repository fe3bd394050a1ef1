#include "integrators/view/field_region.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace tensorray {

using Eigen::Vector3d;

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

/// @param sign   Of the flexibility: 1 for light, −1 for light that is followed back.
/// @param gains  Whether the gain of a way is that along its ray; otherwise it is 1.
/// @param rays   Set to the rays of the ways.
void FieldRegion::follow(double sign, bool gains, RayBatch& rays, std::vector<BentWay>& ways) const {
  rays.clear();
  for (const BentWay& way : ways)
    rays.add(way.position, way.direction, sign * settings_.flexibility(way.band, way.place));
  rays.wants_radiance_change = true;
  rays.tensor_samples = 0;
  trace(field_, geometry_, settings_.bending, rays);
  tensor_samples_ += rays.tensor_samples;
  steps_ += std::accumulate(rays.steps.begin(), rays.steps.end(), std::uint64_t{0});
  for (std::size_t i = 0; i < ways.size(); ++i) {
    BentWay& way = ways[i];
    const RayEnd end = rays.end[i];
    way.position = rays.position[i];
    way.direction = rays.direction[i];
    way.arrives = end == RayEnd::missed || end == RayEnd::obstacle;
    way.on_surface = end == RayEnd::obstacle;
    way.gain = gains && way.arrives ? std::exp(rays.radiance_change[i]) : 1;
    way.compression = std::exp(-sign * rays.radiance_change[i]);
  }
}

void FieldRegion::follow_back(std::vector<BentWay>& ways) const {
  RayBatch& rays = memory_.local();
  follow(-1, settings_.conserve == Conserve::power, rays, ways);
  for (std::size_t i = 0; i < ways.size(); ++i) {
    BentWay& way = ways[i];
    ++ends_[static_cast<std::size_t>(rays.end[i])];
    if (way.arrives && settings_.most_gain > 0 && !(way.gain <= settings_.most_gain)) {
      way.gain = settings_.most_gain;
      ++limited_;
    }
    way.arrives = way.arrives && std::isfinite(way.gain);
  }
}

/// Where radiance stays, the power of a photon changes as the radiance of a photon of constant power, the other way.
void FieldRegion::follow_light(std::vector<BentWay>& ways) const {
  follow(1, settings_.conserve == Conserve::radiance, memory_.local(), ways);
  for (BentWay& way : ways) way.arrives = way.arrives && std::isfinite(way.gain);
}

}  // namespace tensorray
