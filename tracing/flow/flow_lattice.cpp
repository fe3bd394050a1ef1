#include "tracing/flow/flow_lattice.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

#include "base/geometry/box.h"

namespace tensorray {
namespace {

constexpr int max_columns = 1 << 12;  // Number of first quads along a side.

// Sides of first quads, for the usual tolerance: so many pixels of straight light, or a voxel of the finest level.
constexpr double first_pixels = 8;
constexpr double max_for_voxels = 64;    // Voxels ask for no more quads than this along a side.
constexpr double usual_tolerance = 0.5;  // Pixels.

bool is_parallelogram(const std::vector<Eigen::Vector2d>& polygon) {
  if (polygon.size() != 4) return false;
  const Eigen::Vector2d skew = polygon[0] - polygon[1] + polygon[2] - polygon[3];
  return skew.norm() < 1e-9 * (polygon[2] - polygon[0]).norm();
}

/// The place of a line of a lattice of `count` quads, in [0, 1].
/// @param at      In quads.
/// @param begins  Whether the lines of the first quad gather at its begin; likewise `ends` for the last one.
double graded(double at, int count, bool begins, bool ends) {
  const double first = ends && count == 1 ? 0.5 : 1, last = begins && count == 1 ? 0.5 : 1;  // Sizes of what is graded.
  const double left = count - at;
  if (begins && at < first)
    at = at * at / first;
  else if (ends && left < last)
    at = count - left * left / last;
  return at / count;
}

using LatticePoint = Eigen::Array<std::uint32_t, 2, 1>;

constexpr float torn_ratio = 6;  // A side is torn if its landings are so much farther apart than those of the next.

class TriangleBuilder {
 public:
  TriangleBuilder(const FlowLattice& lattice, const Beam& beam, FlowMap& map)
      : lattice_(lattice), beam_(beam), map_(map) {}

  void build(const std::vector<Quad>& quads) {
    std::vector<std::uint8_t> plain(quads.size()), torn(quads.size());
    tbb::parallel_for(std::size_t{0}, quads.size(), [&](std::size_t i) {
      plain[i] = is_plain(quads[i]);
      torn[i] = is_torn(quads[i]);
    });
    map_.triangles.reserve(3 * quads.size());
    map_.edges.reserve(5 * quads.size());
    next_edge_.reserve(5 * quads.size());
    first_outline_edge_.assign(map_.starts.size(), FlowEdge::none);
    for (std::size_t i = 0; i < quads.size(); ++i)
      plain[i] ? divide_plain(quads[i], torn[i]) : divide_outlined(quads[i], torn[i]);
  }

 private:
  /// Whether the map jumps across a side of a smallest quad. The landings at its ends are then far apart, and those
  /// at the ends of the side's other half, in the parent, are not.
  bool is_torn(const Quad& quad) const {
    if (quad.level < lattice_.levels || !(quad.deviation > torn_pixels / 2)) return false;
    const std::uint32_t half = lattice_.side_of(quad), left = quad.x / (2 * half) * 2 * half,
                        top = quad.y / (2 * half) * 2 * half;
    std::array<std::array<std::uint32_t, 3>, 3> grid;  // The vertices of the parent, by row and column.
    for (std::uint32_t row = 0; row < 3; ++row)
      for (std::uint32_t column = 0; column < 3; ++column)
        grid[row][column] = lattice_.vertices.at(FlowLattice::key(quad.patch, left + column * half, top + row * half));
    const std::size_t x = (quad.x - left) / half, y = (quad.y - top) / half;
    for (const std::size_t i : {0, 1})
      if (is_torn(grid[y + i][x], grid[y + i][x + 1], grid[y + i][2 * (1 - x)], grid[y + i][1]) ||
          is_torn(grid[y][x + i], grid[y + 1][x + i], grid[2 * (1 - y)][x + i], grid[1][x + i]))
        return true;
    return false;
  }

  /// Whether the map jumps between two vertices, at some wavelength, and not between the two of the next side. Both are
  /// compared by the lengths of the sides, which differ at the beam's edge.
  bool is_torn(std::uint32_t a, std::uint32_t b, std::uint32_t next_a, std::uint32_t next_b) const {
    const auto length = [&](std::uint32_t from, std::uint32_t to) {
      return static_cast<float>((map_.starts[to] - map_.starts[from]).norm());
    };
    const float by_length = torn_ratio * length(a, b) / length(next_a, next_b);
    for (std::size_t sample = 0; sample < map_.wavelengths; ++sample) {
      const auto landed = [&](std::uint32_t vertex) { return map_.landed(vertex, sample); };
      const auto distance = [&](std::uint32_t from, std::uint32_t to) {
        return (map_.landing(from, sample) - map_.landing(to, sample)).norm();
      };
      if (!landed(a) || !landed(b) || !landed(next_a) || !landed(next_b)) continue;
      const float jump = distance(a, b);
      if (jump > torn_pixels && jump > by_length * distance(next_a, next_b)) return true;
    }
    return false;
  }

  /// Appends the vertices on a side, without its end. There are some between its ends if a neighbour is finer.
  /// @param vertex  The one at `from`.
  void add_side(std::uint32_t patch, const LatticePoint& from, const LatticePoint& to, std::uint32_t vertex,
                std::vector<std::uint32_t>& outline) const {
    const LatticePoint at = (from + to) / 2u;
    const auto middle = (at != from).any() && (at != to).any()
                            ? lattice_.vertices.find(FlowLattice::key(patch, at.x(), at.y()))
                            : lattice_.vertices.end();
    if (middle == lattice_.vertices.end()) {
      outline.push_back(vertex);
      return;
    }
    add_side(patch, from, at, vertex, outline);
    add_side(patch, at, to, middle->second, outline);
  }

  std::vector<std::uint32_t> outline_of(const Quad& quad) const {
    const std::uint32_t x = quad.x, y = quad.y, side = lattice_.side_of(quad);
    const std::array<LatticePoint, 4> points{{{x, y}, {x + side, y}, {x + side, y + side}, {x, y + side}}};
    std::vector<std::uint32_t> outline;
    for (std::size_t i = 0; i < 4; ++i) add_side(quad.patch, points[i], points[(i + 1) % 4], quad.corners[i], outline);
    return outline;
  }

  /// Whether there is no vertex between its corners.
  bool is_plain(const Quad& quad) const {
    const std::uint32_t x = quad.x, y = quad.y, side = lattice_.side_of(quad), half = side / 2, p = quad.patch;
    const auto is_free = [&](std::uint32_t at_x, std::uint32_t at_y) {
      return !lattice_.vertices.count(FlowLattice::key(p, at_x, at_y));
    };
    return half == 0 ||
           (is_free(x + half, y) && is_free(x + side, y + half) && is_free(x + half, y + side) && is_free(x, y + half));
  }

  /// The mean of a quad's corners, as a new vertex.
  std::uint32_t add_center(const Quad& quad) {
    const auto center = static_cast<std::uint32_t>(map_.starts.size());
    Eigen::Vector2d start(0, 0);
    for (const std::uint32_t corner : quad.corners) start += map_.starts[corner] / 4;
    map_.starts.push_back(start);
    for (std::size_t sample = 0; sample < map_.wavelengths; ++sample) {
      Eigen::Vector2f at(0, 0);
      RayEnd end = RayEnd::plate;
      for (const std::uint32_t corner : quad.corners) {
        at += map_.landing(corner, sample) / 4;
        if (!map_.landed(corner, sample)) end = map_.ends[corner * map_.wavelengths + sample];
      }
      map_.landings.push_back(at);
      map_.ends.push_back(end);
    }
    const std::size_t checks = map_.checks();
    for (std::size_t check = 0; check < checks; ++check) {
      float length = 0;
      for (const std::uint32_t corner : quad.corners) length += map_.lengths[corner * checks + check] / 4;
      map_.lengths.push_back(length);
    }
    return center;
  }

  std::uint32_t add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, float error, bool torn) {
    const double area = start_area(beam_, map_.starts[a], map_.starts[b], map_.starts[c]);
    map_.triangles.push_back({{a, b, c}, area, error, torn});
    return static_cast<std::uint32_t>(map_.triangles.size() - 1);
  }

  /// Adds a side of a quad's outline; if the neighbour has added it already, joins the two.
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
  void divide_plain(const Quad& quad, bool torn) {
    const auto& [a, b, c, d] = quad.corners;
    const std::uint32_t first = add_triangle(a, b, c, quad.error, torn);
    const std::uint32_t second = add_triangle(a, c, d, quad.error, torn);
    add_edge({c, a, first, second});
    for (std::size_t i = 0; i < 4; ++i)
      add_outline_edge(quad.corners[i], quad.corners[(i + 1) % 4], i < 2 ? first : second);
  }

  /// As many triangles as the outline has sides, about a vertex in the middle.
  void divide_outlined(const Quad& quad, bool torn) {
    const std::vector<std::uint32_t> outline = outline_of(quad);
    const std::uint32_t center = add_center(quad);
    const auto first = static_cast<std::uint32_t>(map_.triangles.size()),
               count = static_cast<std::uint32_t>(outline.size());
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t from = outline[i], to = outline[(i + 1) % count];
      const std::uint32_t triangle = add_triangle(from, to, center, quad.error, torn);
      add_outline_edge(from, to, triangle);
      add_edge({to, center, triangle, first + (i + 1) % count});
    }
  }

  const FlowLattice& lattice_;
  const Beam& beam_;
  FlowMap& map_;
  // The outlines' edges from each vertex, as lists: the first one of a vertex, and the next one after an edge.
  std::vector<std::uint32_t> first_outline_edge_, next_edge_;
};

/// The part of a convex polygon on the left of a line.
std::vector<Eigen::Vector2d> part_left_of(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                                          const std::vector<Eigen::Vector2d>& polygon) {
  const Eigen::Vector2d left = Eigen::Vector2d(from.y() - to.y(), to.x() - from.x()).normalized();
  const double rounding = 1e-12 * (to - from).norm();
  std::vector<Eigen::Vector2d> part;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double at_a = left.dot(a - from), at_b = left.dot(b - from);
    if (at_a >= -rounding) part.push_back(a);
    if (std::min(at_a, at_b) < -rounding && std::max(at_a, at_b) > rounding)
      part.emplace_back(a + at_a / (at_a - at_b) * (b - a));
  }
  return part;
}

}  // namespace

double pixel_of_starts(const Plate& plate, const Beam& beam) {
  const double slope =
      std::abs(plate.normal().dot(beam.direction)) / std::abs(beam.right.cross(beam.up).dot(beam.direction));
  return start_ratio(beam, plate.center) * std::sqrt(plate.pixel_area() * std::clamp(slope, 1e-6, 1e6));
}

double first_size(const TensorField& field, const Beam& beam, double pixel, const FlowSettings& settings) {
  const Eigen::Vector2d extent = box_of(core_of(beam)).sizes();
  const double voxel =
      std::ldexp(start_ratio(beam, field.world_box().center()) * field.to_world().linear().colwise().norm().minCoeff(),
                 1 - field.levels());
  const double for_voxels = std::max(voxel, extent.maxCoeff() / max_for_voxels);
  const double usual = std::min(first_pixels * pixel, for_voxels);
  const double least = std::sqrt(16 * box_of(beam.aperture).sizes().prod() / static_cast<double>(settings.max_starts));
  return std::max(usual * std::sqrt(settings.tolerance / usual_tolerance), least);
}

std::vector<Patch> patches_around(const std::vector<Eigen::Vector2d>& inner, const std::vector<Eigen::Vector2d>& outer,
                                  double quad_size) {
  constexpr double least_part = 1e-9;
  std::vector<Patch> patches;
  std::vector<Eigen::Vector2d> rest = outer;
  for (std::size_t i = 0; i < inner.size(); ++i) {
    const Eigen::Vector2d &from = inner[i], &to = inner[(i + 1) % inner.size()];
    const std::vector<Eigen::Vector2d> part = part_left_of(to, from, rest);
    rest = part_left_of(from, to, rest);
    if (part.size() < 3 || !(area(part) > least_part * area(outer))) continue;
    for (Patch& patch : patches_of(part, quad_size)) {
      patch.is_edge = {};
      patches.push_back(patch);
    }
  }
  return patches;
}

std::vector<Patch> patches_of(const std::vector<Eigen::Vector2d>& polygon, double quad_size) {
  std::vector<Patch> patches;
  const std::size_t n = polygon.size();
  if (is_parallelogram(polygon)) {
    patches.push_back({{polygon[0], polygon[1], polygon[2], polygon[3]}, {true, true, true, true}});
  } else {
    Eigen::Vector2d center(0, 0);
    for (const Eigen::Vector2d& corner : polygon) center += corner / static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector2d &corner = polygon[i], &next = polygon[(i + 1) % n], &last = polygon[(i + n - 1) % n];
      patches.push_back({{(last + corner) / 2, corner, (corner + next) / 2, center}, {true, true, false, false}});
    }
  }
  for (Patch& patch : patches) {
    const auto count = [&](int a, int b, int c, int d) {
      const double length =
          std::max((patch.corners[b] - patch.corners[a]).norm(), (patch.corners[d] - patch.corners[c]).norm());
      return static_cast<int>(std::clamp(std::ceil(length / quad_size), 1.0, double{max_columns}));
    };
    patch.columns = count(0, 1, 3, 2);
    patch.rows = count(1, 2, 0, 3);
  }
  return patches;
}

double FlowLattice::u_of(std::uint32_t patch, std::uint32_t x) const {
  const Patch& p = patches[patch];
  return graded(std::ldexp(x, -levels), p.columns, is_graded && p.is_edge[3], is_graded && p.is_edge[1]);
}

double FlowLattice::v_of(std::uint32_t patch, std::uint32_t y) const {
  const Patch& p = patches[patch];
  return graded(std::ldexp(y, -levels), p.rows, is_graded && p.is_edge[0], is_graded && p.is_edge[2]);
}

bool FlowLattice::is_at_edge(const Quad& quad) const {
  const Patch& patch = patches[quad.patch];
  const std::uint32_t column = quad.x >> levels, row = quad.y >> levels;
  return (patch.is_edge[0] && row == 0) ||
         (patch.is_edge[1] && column + 1 == static_cast<std::uint32_t>(patch.columns)) ||
         (patch.is_edge[2] && row + 1 == static_cast<std::uint32_t>(patch.rows)) || (patch.is_edge[3] && column == 0);
}

void add_triangles(const FlowLattice& lattice, const std::vector<Quad>& quads, const Beam& beam, FlowMap& map) {
  TriangleBuilder(lattice, beam, map).build(quads);
}

}  // namespace tensorray
