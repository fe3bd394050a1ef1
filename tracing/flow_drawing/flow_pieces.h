#pragma once
/// The triangles of a flow map in pieces that are drawn alike. A part of caustic.h.

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "tracing/flow/cutoff.h"
#include "tracing/flow/flow_map.h"

namespace tensorray {

/// How often a triangle is drawn. 0: once a band. n > 0: n + 1 times a band, each time for a part of the band. n < 0:
/// once for 2^−n bands in a row.
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
  };

  Detail detail = 0;
  double area = 0;                      ///< Of all triangles, in the aperture.
  std::vector<std::uint32_t> vertices;  ///< Their indices in the map.
  std::vector<Triangle> triangles;
  std::vector<Edge> edges;  ///< The sides of the triangles, once.
  bool always_lands = true;
  bool has_torn = false;
  std::vector<Cutoff> cutoffs;  ///< Of the vertices.
};

/// The map's triangles in groups of neighbours, and how often each is drawn.
struct FlowPieces {
  const FlowMap* map = nullptr;
  std::vector<std::int8_t> details;                 ///< One for each triangle.
  std::vector<std::array<std::uint32_t, 3>> edges;  ///< The three edges of each triangle.
  std::vector<std::pair<float, float>> rows;  ///< Where light of each group lands, from the first row to the last.

  std::size_t groups() const { return rows.size(); }
};

/// @param steps  Steps of light within a band if it moves by 1 pixel from wavelength sample to wavelength sample.
/// @param bands  Number of bands that may be drawn as one.
/// The map must outlive the result.
FlowPieces divide_map(const FlowMap& map, double steps, std::size_t bands);

/// The triangles of a group: a piece for each detail.
std::vector<FlowPiece> pieces_of(const FlowPieces& pieces, std::size_t group);

}  // namespace tensorray
