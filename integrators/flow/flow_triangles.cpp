#include "integrators/flow/flow_triangles.h"

#include <array>
#include <cstdint>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

constexpr float torn_ratio = 6;  // A side is torn if its landings are so much farther apart than those of the next.

class TriangleBuilder {
 public:
  TriangleBuilder(const FlowLattice& lattice, const Beam& beam, FlowMap& map)
      : lattice_(lattice), beam_(beam), map_(map) {}

  void build(const std::vector<Square>& squares) {
    std::vector<std::uint8_t> plain(squares.size()), torn(squares.size());
    tbb::parallel_for(std::size_t{0}, squares.size(), [&](std::size_t i) {
      plain[i] = is_plain(squares[i]);
      torn[i] = is_torn(squares[i]);
    });
    map_.triangles.reserve(3 * squares.size());
    map_.edges.reserve(5 * squares.size());
    next_edge_.reserve(5 * squares.size());
    first_outline_edge_.assign(map_.starts.size(), FlowEdge::none);
    for (std::size_t i = 0; i < squares.size(); ++i)
      plain[i] ? divide_plain(squares[i], torn[i]) : divide_outlined(squares[i], torn[i]);
  }

 private:
  bool landed(std::uint32_t position, std::size_t node) const {
    return map_.ends[position * map_.nodes + node] == RayEnd::plate;
  }
  Eigen::Vector2f landing(std::uint32_t position, std::size_t node) const {
    return map_.landings[position * map_.nodes + node];
  }

  /// Whether the map jumps across a side of a smallest square. The landings at its ends are then far apart, and those
  /// at the ends of the side's other half, in the parent, are not.
  bool is_torn(const Square& square) const {
    if (square.level < lattice_.levels - lattice_.still_levels || !(square.deviation > torn_pixels / 2)) return false;
    const std::uint32_t half = lattice_.side_of(square), left = square.x / (2 * half) * 2 * half,
                        top = square.y / (2 * half) * 2 * half;
    std::array<std::array<std::uint32_t, 3>, 3> grid;  // The positions of the parent, by row and column.
    for (std::uint32_t row = 0; row < 3; ++row)
      for (std::uint32_t column = 0; column < 3; ++column)
        grid[row][column] =
            lattice_.positions.at(FlowLattice::key(square.patch, left + column * half, top + row * half));
    const std::size_t x = (square.x - left) / half, y = (square.y - top) / half;
    for (const std::size_t i : {0, 1})
      if (is_torn(grid[y + i][x], grid[y + i][x + 1], grid[y + i][2 * (1 - x)], grid[y + i][1]) ||
          is_torn(grid[y][x + i], grid[y + 1][x + i], grid[2 * (1 - y)][x + i], grid[1][x + i]))
        return true;
    return false;
  }

  /// Whether the map jumps, at any node, between two positions, and not between the two of the next side, by the
  /// lengths of both: at the beam's edge they differ.
  bool is_torn(std::uint32_t a, std::uint32_t b, std::uint32_t next_a, std::uint32_t next_b) const {
    const auto length = [&](std::uint32_t from, std::uint32_t to) {
      return static_cast<float>((map_.starts[to] - map_.starts[from]).norm());
    };
    const float by_length = torn_ratio * length(a, b) / length(next_a, next_b);
    for (std::size_t node = 0; node < map_.nodes; ++node) {
      if (!landed(a, node) || !landed(b, node) || !landed(next_a, node) || !landed(next_b, node)) continue;
      const float jump = (landing(a, node) - landing(b, node)).norm(),
                  next = (landing(next_a, node) - landing(next_b, node)).norm();
      if (jump > torn_pixels && jump > by_length * next) return true;
    }
    return false;
  }

  /// Appends the positions on a side between two corners, without its end. They are there if a neighbour is finer.
  void add_side(const Square& square, std::uint32_t x0, std::uint32_t y0, std::uint32_t x1, std::uint32_t y1,
                std::uint32_t from, std::vector<std::uint32_t>& outline) const {
    const std::uint32_t x = (x0 + x1) / 2, y = (y0 + y1) / 2;
    const auto middle = (x != x0 || y != y0) && (x != x1 || y != y1)
                            ? lattice_.positions.find(FlowLattice::key(square.patch, x, y))
                            : lattice_.positions.end();
    if (middle == lattice_.positions.end()) {
      outline.push_back(from);
      return;
    }
    add_side(square, x0, y0, x, y, from, outline);
    add_side(square, x, y, x1, y1, middle->second, outline);
  }

  std::vector<std::uint32_t> outline_of(const Square& square) const {
    const std::uint32_t x = square.x, y = square.y, side = lattice_.side_of(square);
    const auto& [a, b, c, d] = square.corners;
    std::vector<std::uint32_t> outline;
    add_side(square, x, y, x + side, y, a, outline);
    add_side(square, x + side, y, x + side, y + side, b, outline);
    add_side(square, x + side, y + side, x, y + side, c, outline);
    add_side(square, x, y + side, x, y, d, outline);
    return outline;
  }

  /// Whether there is no position between its corners.
  bool is_plain(const Square& square) const {
    const std::uint32_t x = square.x, y = square.y, side = lattice_.side_of(square), half = side / 2, p = square.patch;
    const auto is_free = [&](std::uint32_t at_x, std::uint32_t at_y) {
      return !lattice_.positions.count(FlowLattice::key(p, at_x, at_y));
    };
    return half == 0 ||
           (is_free(x + half, y) && is_free(x + side, y + half) && is_free(x + half, y + side) && is_free(x, y + half));
  }

  /// The mean of a square's corners, as a new position.
  std::uint32_t add_center(const Square& square) {
    const auto center = static_cast<std::uint32_t>(map_.starts.size());
    Eigen::Vector2d start(0, 0);
    for (const std::uint32_t corner : square.corners) start += map_.starts[corner] / 4;
    map_.starts.push_back(start);
    for (std::size_t node = 0; node < map_.nodes; ++node) {
      Eigen::Vector2f at(0, 0);
      RayEnd end = RayEnd::plate;
      for (const std::uint32_t corner : square.corners) {
        at += landing(corner, node) / 4;
        if (!landed(corner, node)) end = map_.ends[corner * map_.nodes + node];
      }
      map_.landings.push_back(at);
      map_.ends.push_back(end);
    }
    const std::size_t checks = (map_.nodes - 1) / map_.check_step + 1;
    for (std::size_t check = 0; check < checks; ++check) {
      float length = 0;
      for (const std::uint32_t corner : square.corners) length += map_.lengths[corner * checks + check] / 4;
      map_.lengths.push_back(length);
    }
    return center;
  }

  std::uint32_t add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, float error, bool torn) {
    const double area = start_area(beam_, map_.starts[a], map_.starts[b], map_.starts[c]);
    map_.triangles.push_back({{a, b, c}, area, error, torn});
    return static_cast<std::uint32_t>(map_.triangles.size() - 1);
  }

  /// Adds a side of a square's outline; if the neighbour has added it already, joins the two.
  void add_outline_edge(std::uint32_t from, std::uint32_t to, std::uint32_t triangle) {
    for (std::uint32_t other = first_outline_edge_[to]; other != FlowEdge::none; other = next_edge_[other])
      if (map_.edges[other].to == from) {
        map_.edges[other].against = triangle;
        return;
      }
    const std::uint32_t edge = add_edge({from, to, triangle, FlowEdge::none});
    next_edge_[edge] = first_outline_edge_[from];
    first_outline_edge_[from] = edge;
  }

  std::uint32_t add_edge(const FlowEdge& edge) {
    map_.edges.push_back(edge);
    next_edge_.push_back(FlowEdge::none);
    return static_cast<std::uint32_t>(map_.edges.size() - 1);
  }

  /// Two triangles.
  void divide_plain(const Square& square, bool torn) {
    const auto& [a, b, c, d] = square.corners;
    const std::uint32_t first = add_triangle(a, b, c, square.error, torn);
    const std::uint32_t second = add_triangle(a, c, d, square.error, torn);
    add_edge({c, a, first, second, true});
    for (std::size_t i = 0; i < 4; ++i)
      add_outline_edge(square.corners[i], square.corners[(i + 1) % 4], i < 2 ? first : second);
  }

  /// As many triangles as the outline has sides, about a position in the middle.
  void divide_outlined(const Square& square, bool torn) {
    const std::vector<std::uint32_t> outline = outline_of(square);
    const std::uint32_t center = add_center(square);
    const auto first = static_cast<std::uint32_t>(map_.triangles.size()),
               count = static_cast<std::uint32_t>(outline.size());
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t from = outline[i], to = outline[(i + 1) % count];
      const std::uint32_t triangle = add_triangle(from, to, center, square.error, torn);
      add_outline_edge(from, to, triangle);
      add_edge({to, center, triangle, first + (i + 1) % count});
    }
  }

  const FlowLattice& lattice_;
  const Beam& beam_;
  FlowMap& map_;
  // The outlines' edges from each position, as lists: the first one of a position, and the next one after an edge.
  std::vector<std::uint32_t> first_outline_edge_, next_edge_;
};

}  // namespace

void add_triangles(const FlowLattice& lattice, const std::vector<Square>& squares, const Beam& beam, FlowMap& map) {
  TriangleBuilder(lattice, beam, map).build(squares);
}

}  // namespace tensorray
