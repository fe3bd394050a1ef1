#pragma once
/// @file integrators/flow/flow_pieces.h
/// A flow map in small pieces, each of which is drawn at places of its own in the spectrum. A part of caustic.cpp.

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "integrators/flow/flow_map.h"

namespace tensorray {

/// How often a triangle is drawn: at 0, once a band; at n > 0, in n + 1 parts of each band; at n < 0, once for a run of
/// bands, which is twice as long as at n + 1.
using Detail = int;

/// Neighbouring triangles of one detail, with indices of their own.
struct FlowPiece {
  struct Triangle {
    std::array<std::uint16_t, 3> corners{};
    double area = 0;
    bool is_torn = false;
  };
  struct Edge {
    static constexpr std::uint16_t none = 0xffff;
    std::uint16_t from = 0, to = 0, along = none, against = none;  // See FlowEdge.
    bool is_diagonal = false;
  };

  Detail detail = 0;
  double area = 0;                       ///< Of all triangles, in the aperture.
  std::vector<std::uint32_t> positions;  ///< Their indices in the map.
  std::vector<Triangle> triangles;
  std::vector<Edge> edges;  ///< All of which one side, at least, is one of the triangles.
  bool always_lands = true;
  std::vector<Eigen::Vector2f> landings;  ///< At [node · positions.size() + i].
};

/// The map's triangles in groups of neighbours, and how often each is drawn.
struct FlowPieces {
  const FlowMap* map = nullptr;
  std::vector<std::int8_t> details;                 ///< One for each triangle.
  std::vector<std::array<std::uint32_t, 3>> edges;  ///< The three edges of each triangle.
  std::vector<std::pair<float, float>>
      rows;  ///< From the first to the last one in which the light of each group lands, pixels.

  std::size_t groups() const { return rows.size(); }
};

/// @param steps  The number of steps in the distance that light moves within a band, if it moves 1 pixel from node to
///               node.
/// @param bands  Their number, or 1 if they are apart.
/// The map must outlive the result.
FlowPieces divide_map(const FlowMap& map, double steps, std::size_t bands);

/// The pieces of a group. Any number of threads may call it.
std::vector<FlowPiece> pieces_of(const FlowPieces& pieces, std::size_t group);

}  // namespace tensorray
