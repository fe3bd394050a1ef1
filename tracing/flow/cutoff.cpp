#include "tracing/flow/cutoff.h"

namespace tensorray {

using Kind = Cutoff::Kind;

Cutoff cutoff_of(const FlowMap& map, std::size_t vertex) {
  const bool lands = map.landed(vertex, 0);
  Cutoff cutoff{lands ? Kind::always : Kind::never};
  for (std::size_t sample = 1; sample < map.wavelengths; ++sample) {
    if (map.landed(vertex, sample) == map.landed(vertex, sample - 1)) continue;
    if (cutoff.is_single()) return {};
    cutoff = {lands ? Kind::before : Kind::after, static_cast<double>(sample) - 0.5};
  }
  return cutoff;
}

ShadowEdge edge_between(const Cutoff* cutoffs, std::size_t count) {
  ShadowEdge edge{false, true};
  for (std::size_t i = 0; i < count; ++i) {
    const Cutoff& cutoff = cutoffs[i];
    const bool lands_before = cutoff.kind == Kind::before;
    if (cutoff.kind == Kind::other || (cutoff.is_single() && edge.is_known && edge.lands_before != lands_before))
      return {};
    edge.is_within = edge.is_within && cutoff.is_single();
    if (cutoff.is_single()) edge = {true, edge.is_within, lands_before};
  }
  return edge.is_known ? edge : ShadowEdge();
}

Eigen::Vector2d landing_beyond(const FlowMap& map, std::size_t vertex, const Cutoff& cutoff, double sample,
                               const std::uint32_t* others, std::size_t count) {
  const double last = cutoff.kind == Kind::before ? cutoff.at - 0.5 : cutoff.at + 0.5;
  Eigen::Vector2d moved(0, 0);
  int landed = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const FlowLanding from = landing_at(map, others[i], last), to = landing_at(map, others[i], sample);
    if (from.end != RayEnd::plate || to.end != RayEnd::plate) continue;
    moved += to.at - from.at;
    ++landed;
  }
  return landing_at(map, vertex, last).at + moved / std::max(landed, 1);
}

}  // namespace tensorray
