#include "tracing/flow_drawing/flow_pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

constexpr std::size_t group_size = 512;  // Triangles; their landings stay in the cache while they are drawn.
constexpr Detail max_detail = 15;
constexpr Detail max_partial_detail = 5;  // Of light that does not always end on the same thing: most moves far beside
                                          // the plate.

/// How the light of a vertex moves over the plate.
struct Movement {
  double fastest = 0;   // From sample to sample, at most, pixels.
  bool is_same = true;  // Whether all of it ends on the same thing.
};

/// The movement is that of the parabola through three samples: of a vertex that always lands these are traced, even
/// where others are predicted. What a prediction misses must not change how often a triangle is drawn.
Movement movement_of(const FlowMap& map, std::size_t vertex) {
  const std::size_t begin = vertex * map.wavelengths, end = begin + map.wavelengths;
  Movement movement;
  std::size_t first = end, last = begin;  // That land.
  for (std::size_t i = begin; i < end; ++i) {
    movement.is_same = movement.is_same && map.ends[i] == map.ends[begin];
    if (map.ends[i] != RayEnd::plate) continue;
    first = std::min(first, i);
    last = i;
  }
  if (first >= last) return movement;
  const std::size_t before = (first + last) / 2, after = (first + last + 1) / 2;  // The middle may be no sample.
  const Eigen::Vector2f a = map.landings[first], c = map.landings[last];
  Eigen::Vector2f b = (a + c) / 2;
  if (map.ends[before] == RayEnd::plate && map.ends[after] == RayEnd::plate)
    b = (map.landings[before] + map.landings[after]) / 2;
  const float fastest = std::max((4 * b - 3 * a - c).norm(), (3 * c - 4 * b + a).norm());  // At the ends.
  movement.fastest = fastest / static_cast<float>(last - first);
  return movement;
}

/// @param steps  The steps that light moves within each band.
Detail detail_for(double steps, Detail least, Detail greatest) {
  if (steps > 1) return static_cast<Detail>(std::min<double>(std::ceil(steps) - 1, greatest));
  Detail detail = 0;
  while (detail > least && std::ldexp(steps, 1 - detail) <= 1) --detail;
  return detail;
}

std::vector<std::array<std::uint32_t, 3>> edges_of_triangles(const FlowMap& map) {
  std::vector<std::array<std::uint32_t, 3>> edges(map.triangles.size());
  std::vector<std::uint8_t> counts(map.triangles.size());
  for (std::uint32_t e = 0; e < map.edges.size(); ++e)
    for (const std::uint32_t triangle : {map.edges[e].along, map.edges[e].against})
      if (triangle != FlowEdge::none) edges[triangle][counts[triangle]++] = e;
  return edges;
}

/// The rows in which the light of a group lands, at any sample.
std::pair<float, float> rows_of(const FlowMap& map, std::size_t first, std::size_t last) {
  std::pair<float, float> rows{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
  for (std::size_t t = first; t < last; ++t)
    for (const std::size_t corner : map.triangles[t].corners)
      for (std::size_t i = corner * map.wavelengths; i < (corner + 1) * map.wavelengths; ++i)
        if (map.ends[i] == RayEnd::plate)
          rows = {std::min(rows.first, map.landings[i].y()), std::max(rows.second, map.landings[i].y())};
  return rows;
}

/// Adds triangles and their sides to the pieces of a group.
class PieceBuilder {
 public:
  explicit PieceBuilder(const FlowPieces& pieces, std::size_t group)
      : pieces_(pieces),
        map_(*pieces.map),
        first_(group * group_size),
        last_(std::min(first_ + group_size, map_.triangles.size())) {}

  std::vector<FlowPiece> build() && {
    for (std::size_t t = first_; t < last_; ++t) add_triangle(t);
    for (std::size_t t = first_; t < last_; ++t)
      for (const std::uint32_t edge : pieces_.edges[t]) add_edge(t, map_.edges[edge]);
    for (FlowPiece& piece : result_) add_cutoffs(piece);
    return std::move(result_);
  }

 private:
  bool is_in_piece(std::uint32_t triangle, Detail detail) const {
    return triangle >= first_ && triangle < last_ && pieces_.details[triangle] == detail;
  }

  std::size_t piece_of(Detail detail) {
    std::size_t i = 0;
    while (i < result_.size() && result_[i].detail != detail) ++i;
    if (i == result_.size()) {
      result_.emplace_back().detail = detail;
      indices_.emplace_back();
    }
    return i;
  }

  std::uint16_t vertex(std::size_t piece, std::uint32_t vertex) {
    std::vector<std::uint32_t>& vertices = result_[piece].vertices;
    const auto [found, is_new] = indices_[piece].emplace(vertex, static_cast<std::uint16_t>(vertices.size()));
    if (is_new) vertices.push_back(vertex);
    return found->second;
  }

  void add_triangle(std::size_t t) {
    const FlowTriangle& triangle = map_.triangles[t];
    const std::size_t piece = piece_of(pieces_.details[t]);
    places_[t - first_] = static_cast<std::uint16_t>(result_[piece].triangles.size());
    FlowPiece::Triangle added;
    for (std::size_t i = 0; i < 3; ++i) added.corners[i] = vertex(piece, triangle.corners[i]);
    added.area = triangle.area;
    added.is_torn = triangle.is_torn;
    result_[piece].has_torn = result_[piece].has_torn || triangle.is_torn;
    result_[piece].area += triangle.area;
    result_[piece].triangles.push_back(added);
  }

  /// An edge of two triangles of the piece is added once, with the first of them.
  void add_edge(std::size_t t, const FlowEdge& edge) {
    const Detail detail = pieces_.details[t];
    const bool has_along = is_in_piece(edge.along, detail), has_against = is_in_piece(edge.against, detail);
    if (has_along && has_against && t != edge.along) return;
    const std::size_t piece = piece_of(detail);
    FlowPiece::Edge added{vertex(piece, edge.from), vertex(piece, edge.to)};
    if (has_along) added.along = places_[edge.along - first_];
    if (has_against) added.against = places_[edge.against - first_];
    result_[piece].edges.push_back(added);
  }

  void add_cutoffs(FlowPiece& piece) const {
    for (const std::uint32_t vertex : piece.vertices) {
      piece.cutoffs.push_back(cutoff_of(map_, vertex));
      piece.always_lands = piece.always_lands && piece.cutoffs.back().kind == Cutoff::Kind::always;
    }
  }

  const FlowPieces& pieces_;
  const FlowMap& map_;
  const std::size_t first_, last_;
  std::array<std::uint16_t, group_size> places_{};  // Of the triangles in their pieces.
  std::vector<FlowPiece> result_;
  std::vector<std::unordered_map<std::uint32_t, std::uint16_t>> indices_;
};

}  // namespace

FlowPieces divide_map(const FlowMap& map, double steps, std::size_t bands) {
  const auto least = -static_cast<Detail>(std::ceil(std::log2(static_cast<double>(bands))));
  FlowPieces pieces;
  pieces.map = &map;
  pieces.edges = edges_of_triangles(map);
  std::vector<std::int8_t> of_vertex(map.starts.size());
  tbb::parallel_for(std::size_t{0}, map.starts.size(), [&](std::size_t i) {
    const Movement movement = movement_of(map, i);
    const double within = steps * movement.fastest;
    of_vertex[i] = static_cast<std::int8_t>(movement.is_same ? detail_for(within, least, max_detail)
                                                             : detail_for(within, 0, max_partial_detail));
  });
  for (const FlowTriangle& triangle : map.triangles) {
    const auto& [a, b, c] = triangle.corners;
    pieces.details.push_back(std::max({of_vertex[a], of_vertex[b], of_vertex[c]}));
  }
  pieces.rows.resize((map.triangles.size() + group_size - 1) / group_size);
  tbb::parallel_for(std::size_t{0}, pieces.rows.size(), [&](std::size_t group) {
    const std::size_t first = group * group_size;
    pieces.rows[group] = rows_of(map, first, std::min(first + group_size, map.triangles.size()));
  });
  return pieces;
}

std::vector<FlowPiece> pieces_of(const FlowPieces& pieces, std::size_t group) {
  return PieceBuilder(pieces, group).build();
}

}  // namespace tensorray
