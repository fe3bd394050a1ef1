#include "tracing/flow/cutoff.h"

#include <algorithm>

namespace tensorray {

using Kind = Cutoff::Kind;

Cutoff cutoff_of(const FlowMap& map, std::size_t vertex) {
  const bool lands = map.landed(vertex, 0);
  Cutoff cutoff{lands ? Kind::always : Kind::never};
  for (std::size_t sample = 0; sample < map.wavelengths; ++sample) {
    cutoff.by_side |= map.ends[vertex * map.wavelengths + sample] == RayEnd::side;
    if (sample == 0 || map.landed(vertex, sample) == map.landed(vertex, sample - 1)) continue;
    const bool is_first = cutoff.kind == Kind::always || cutoff.kind == Kind::never;
    cutoff.kind = !is_first ? Kind::other : lands ? Kind::before : Kind::after;
    cutoff.at = static_cast<double>(sample) - 0.5;
  }
  return cutoff;
}

ShadowEdge edge_between(const Cutoff* cutoffs, std::size_t count) {
  ShadowEdge edge;
  std::size_t single = 0, before = 0;
  bool is_mixed = false;
  for (std::size_t i = 0; i < count; ++i) {
    single += cutoffs[i].is_single();
    before += cutoffs[i].kind == Kind::before;
    is_mixed |= cutoffs[i].kind == Kind::other;
    edge.by_side |= cutoffs[i].by_side;
  }
  edge.lands_before = before > 0;
  edge.is_known = single > 0 && !is_mixed && (before == 0 || before == single);
  edge.is_within = edge.is_known && single == count;
  return edge;
}

Eigen::Vector2d landing_beyond(const FlowMap& map, std::size_t vertex, double sample, const std::uint32_t* others,
                               std::size_t count) {
  const Cutoff cutoff = cutoff_of(map, vertex);
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

std::optional<std::array<LitTriangle, 2>> lit_part(const FlowMap& map, const std::array<std::uint32_t, 3>& vertices,
                                                   const std::array<Cutoff, 3>& cutoffs, double sample) {
  const ShadowEdge edge = edge_between(cutoffs.data(), 3);
  const bool is_dark =
      std::any_of(cutoffs.begin(), cutoffs.end(), [](const Cutoff& cutoff) { return cutoff.kind == Kind::never; });
  if (!map.is_range() || !edge.is_known || is_dark) return std::nullopt;
  std::array<FlowLanding, 3> landings;
  int lit = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    landings[i] = landing_at(map, vertices[i], sample);
    lit += landings[i].end == RayEnd::plate;
  }
  if (lit == 0 || lit == 3) return std::nullopt;
  std::array<double, 3> depth{};  // How far a corner is on the lit side, in samples.
  std::array<Eigen::Vector2d, 3> at;
  const double beyond = edge.lands_before ? static_cast<double>(map.wavelengths) - 0.5 : -0.5;
  for (std::size_t i = 0; i < 3; ++i) {
    const double place = cutoffs[i].is_single() ? cutoffs[i].at : beyond;
    depth[i] = edge.lands_before ? place - sample : sample - place;
    at[i] = landings[i].end == RayEnd::plate ? landings[i].at
                                             : landing_beyond(map, vertices[i], sample, vertices.data(), 3);
  }
  std::size_t alone = 0;  // The corner that has no other one on its side of the edge.
  while ((landings[alone].end == RayEnd::plate) != (lit == 1)) ++alone;
  const std::size_t next = (alone + 1) % 3, last = (alone + 2) % 3;
  const auto part_to = [&](std::size_t other) { return depth[alone] / (depth[alone] - depth[other]); };
  const double to_next = part_to(next), to_last = part_to(last);
  const Eigen::Vector2d on_next = at[alone] + to_next * (at[next] - at[alone]),
                        on_last = at[alone] + to_last * (at[last] - at[alone]);
  std::array<LitTriangle, 2> parts;
  if (lit == 1) {
    parts[0] = {{at[alone], on_next, on_last}, to_next * to_last};
  } else {
    parts = {LitTriangle{{on_next, at[next], at[last]}, 1 - to_next},
             LitTriangle{{on_next, at[last], on_last}, to_next * (1 - to_last)}};
  }
  return parts;
}

}  // namespace tensorray
