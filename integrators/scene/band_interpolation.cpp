#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "integrators/scene/field_region.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr std::size_t fewest_ways = 6;
constexpr double max_change = 0.01;  // Of the jacobian, as predicted for the check.

/// Nodes for so many ways: 3 for 8, 4 for 16, 6 for 32.
std::size_t nodes_for(std::size_t ways) { return 3 + (ways - 1) / 8; }

bool starts_alike(const BentRay& a, const BentRay& b) {
  return a.position == b.position && a.direction == b.direction && a.place == b.place && a.tolerance == b.tolerance;
}

void choose_nodes(BandGroup& group) {
  const std::size_t count = nodes_for(group.count);
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

/// @param nodes  Indices of ways. The abscissa is the number of the band: a ray has the same place in each of its
/// bands.
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
