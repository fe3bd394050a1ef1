#pragma once
/// Where, among the wavelength samples of a range, light of a vertex ceases to land, or begins to. Between vertices
/// this place is linear: so the edge of a shadow, or of light that leaves by a side face, is known within quads that
/// are larger than a pixel.

#include <array>
#include <optional>

#include <Eigen/Core>

#include "tracing/flow/flow_map.h"

namespace tensorray {

struct Cutoff {
  enum class Kind { never, always, before, after, other };
  Kind kind = Kind::other;  ///< Light lands at no sample, at all, at those before or after `at`; or here and there.
  double at = 0;            ///< Halfway between two samples.
  bool by_side = false;     ///< Whether light of a sample leaves by a side face: beside it, landings bend like a root.

  bool is_single() const { return kind == Kind::before || kind == Kind::after; }
};

Cutoff cutoff_of(const FlowMap& map, std::size_t vertex);

template <std::size_t count>
std::array<Cutoff, count> cutoffs_of(const FlowMap& map, const std::array<std::uint32_t, count>& vertices) {
  std::array<Cutoff, count> cutoffs;
  for (std::size_t i = 0; i < count; ++i) cutoffs[i] = cutoff_of(map, vertices[i]);
  return cutoffs;
}

/// The edge of a shadow between some vertices.
struct ShadowEdge {
  bool is_known = false;   ///< Whether some vertices have single cutoffs, all of one kind, and the others are lit or
                           ///< dark at all samples.
  bool is_within = false;  ///< Whether all vertices have such cutoffs.
  bool lands_before = false;
  bool by_side = false;  ///< Whether light of a vertex leaves by a side face.
};

ShadowEdge edge_between(const Cutoff* cutoffs, std::size_t count);

/// Where light of a vertex with a single cutoff would land at a place beyond this, if it moved on from there like light
/// of those `others` that lands at both.
Eigen::Vector2d landing_beyond(const FlowMap& map, std::size_t vertex, double sample, const std::uint32_t* others,
                               std::size_t count);

/// A part of a triangle's light, between its landings.
struct LitTriangle {
  std::array<Eigen::Vector2d, 3> at{};
  double part = 0;
};

/// The lit part of a triangle at a place among the samples at which light of one or two corners lands: on one side of a
/// straight edge, as one triangle or two. None if the edge is not known, or beyond the range.
std::optional<std::array<LitTriangle, 2>> lit_part(const FlowMap& map, const std::array<std::uint32_t, 3>& vertices,
                                                   const std::array<Cutoff, 3>& cutoffs, double sample);

}  // namespace tensorray
