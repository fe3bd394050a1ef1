#include "integrators/flow/flow_map.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <thread>
#include <unordered_map>

#include <tbb/parallel_for.h>

#include "base/box.h"
#include "integrators/flow/node_tracer.h"

namespace tensorray {
namespace {

constexpr double margin = 1.0 / 8;  // Extension of the plate on each side, in sizes of the plate.

// The first squares are of the lesser of these two sizes, for the usual tolerance.
constexpr double first_pixels = 8;       // In pixels of straight light.
constexpr double first_voxels = 1;       // In voxels, so that no part of the field is missed; but not more squares for
constexpr double most_for_voxels = 64;   // this than so many along a side.
constexpr double usual_tolerance = 0.5;  // Pixels.

constexpr float torn_ratio = 6;  // A side is torn if its landings are so much farther apart than those of the next.
constexpr double inset = 3e-6;   // On the aperture's edge, it is a matter of rounding whether rays enter the volume.
                                 // There they start this part of a patch further inside.
constexpr double swept_share = 0.99;  // The part of the positions whose light moves slowly enough from band to band.
constexpr int most_levels = 14;
constexpr int most_columns = 1 << 12;  // Number of first squares along a side.
constexpr std::size_t task_size = 64;  // Positions that one thread traces as one task.

/// A quadrilateral part of the aperture with a lattice of squares; corners counter-clockwise.
struct Patch {
  std::array<Eigen::Vector2d, 4> corners;
  int columns = 1, rows = 1;

  /// The point at (u, v) in [0, 1]²; bilinear.
  Eigen::Vector2d at(double u, double v) const {
    return (1 - v) * ((1 - u) * corners[0] + u * corners[1]) + v * ((1 - u) * corners[3] + u * corners[2]);
  }
};

struct Square {
  std::uint32_t patch = 0, x = 0, y = 0;                     // The lower left corner, on the finest lattice.
  int level = 0;                                             // 0: a first square; each level halves the side.
  float deviation = std::numeric_limits<float>::infinity();  // That of the parent's landings; see `deviation_of`.
  float error = std::numeric_limits<float>::infinity();      // Estimated error of landings within, pixels.
  std::array<std::uint32_t, 4> corners{};                    // Positions, counter-clockwise from the lower left.
};

bool is_parallelogram(const std::vector<Eigen::Vector2d>& polygon) {
  if (polygon.size() != 4) return false;
  const Eigen::Vector2d skew = polygon[0] - polygon[1] + polygon[2] - polygon[3];
  return skew.norm() < 1e-9 * (polygon[2] - polygon[0]).norm();
}

/// One patch, or one about each corner of the polygon, which reaches to the middles of its sides and of the polygon.
std::vector<Patch> patches_of(const std::vector<Eigen::Vector2d>& polygon, double square_size) {
  std::vector<Patch> patches;
  const std::size_t n = polygon.size();
  if (is_parallelogram(polygon)) {
    patches.push_back({{polygon[0], polygon[1], polygon[2], polygon[3]}});
  } else {
    Eigen::Vector2d center(0, 0);
    for (const Eigen::Vector2d& corner : polygon) center += corner / static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector2d &corner = polygon[i], &next = polygon[(i + 1) % n], &last = polygon[(i + n - 1) % n];
      patches.push_back({{(last + corner) / 2, corner, (corner + next) / 2, center}});
    }
  }
  for (Patch& patch : patches) {
    const auto count = [&](int a, int b, int c, int d) {
      const double length =
          std::max((patch.corners[b] - patch.corners[a]).norm(), (patch.corners[d] - patch.corners[c]).norm());
      return static_cast<int>(std::clamp(std::ceil(length / square_size), 1.0, double{most_columns}));
    };
    patch.columns = count(0, 1, 3, 2);
    patch.rows = count(1, 2, 0, 3);
  }
  return patches;
}

/// The size of a pixel in the plane where light starts, as straight light projects it.
double pixel_of_starts(const Plate& plate, const Beam& beam) {
  const double slope =
      std::abs(plate.normal().dot(beam.direction)) / std::abs(beam.right.cross(beam.up).dot(beam.direction));
  return start_ratio(beam, plate.center) * std::sqrt(plate.pixel_area() * std::clamp(slope, 1e-6, 1e6));
}

/// The size of the first squares, world units. Landings between positions are of second order, so that a finer
/// tolerance has smaller squares. For a small number of positions squares are large: a quarter of the number is for the
/// first squares and their first division.
double first_size(const TensorField& field, const Beam& beam, double pixel, const FlowSettings& settings) {
  const Eigen::Vector2d extent = box_of(beam.aperture).sizes();
  const double voxel =
      start_ratio(beam, field.world_box().center()) * field.to_world().linear().colwise().norm().minCoeff();
  const double for_voxels = std::max(first_voxels * voxel, extent.maxCoeff() / most_for_voxels);
  const double usual = std::min(first_pixels * pixel, for_voxels);
  const double least = std::sqrt(16 * extent.prod() / static_cast<double>(settings.most_starts));
  return std::max(usual * std::sqrt(settings.tolerance / usual_tolerance), least);
}

Geometry extended(const Geometry& geometry) {
  Surfaces surfaces = geometry.surfaces();
  surfaces.plate->size *= 1 + 2 * margin;
  return Geometry(std::move(surfaces));
}

class FlowMapBuilder {
 public:
  FlowMapBuilder(const TensorField& field, const Geometry& geometry, const Plate& plate, const Beam& beam,
                 const BendingSettings& bending, const FlowSettings& settings, const Progress& progress)
      : plate_(plate),
        beam_(beam),
        settings_(settings),
        progress_(progress),
        tracer_(field, geometry, plate_, beam, bending, settings) {
    map_.nodes = tracer_.nodes();
    map_.check_step = tracer_.check_step();
    const double pixel = pixel_of_starts(plate_, beam);
    const double size = first_size(field, beam, pixel, settings);
    patches_ = patches_of(beam.aperture, size);
    const double finest = std::min(settings.finest, settings.tolerance) * pixel;
    while (levels_ < most_levels && std::ldexp(size, -levels_) > finest) ++levels_;
  }

  FlowMap build() && {
    add_first_squares();
    trace_new();
    while (divide_squares()) continue;
    make_triangles();
    map_.rays = tracer_.rays();
    map_.ray_steps = tracer_.ray_steps();
    map_.tensor_samples = tracer_.tensor_samples();
    return std::move(map_);
  }

 private:
  static std::uint64_t key(std::uint32_t patch, std::uint32_t x, std::uint32_t y) {
    return std::uint64_t{patch} << 58 | std::uint64_t{x} << 29 | y;
  }

  std::uint32_t position(std::uint32_t patch, std::uint32_t x, std::uint32_t y, const Parents& parents = {}) {
    const auto [found, is_new] = positions_.emplace(key(patch, x, y), static_cast<std::uint32_t>(map_.starts.size()));
    if (is_new) {
      const Patch& p = patches_[patch];
      const double u = std::ldexp(x, -levels_) / p.columns, v = std::ldexp(y, -levels_) / p.rows;
      map_.starts.push_back(p.at(u, v));
      const double least = settings_.silhouette ? inset : 0;
      origins_.push_back(p.at(std::clamp(u, least, 1 - least), std::clamp(v, least, 1 - least)));
      parents_.push_back(parents);
    }
    return found->second;
  }

  void add_first_squares() {
    const std::uint32_t side = 1u << levels_;
    for (std::uint32_t p = 0; p < patches_.size(); ++p)
      for (std::uint32_t row = 0; row < static_cast<std::uint32_t>(patches_[p].rows); ++row)
        for (std::uint32_t column = 0; column < static_cast<std::uint32_t>(patches_[p].columns); ++column) {
          Square square{p, column * side, row * side};
          set_corners(square);
          squares_.push_back(square);
        }
  }

  std::uint32_t side_of(const Square& square) const { return 1u << (levels_ - square.level); }

  void set_corners(Square& square) {
    const std::uint32_t side = side_of(square), x = square.x, y = square.y, p = square.patch;
    square.corners = {position(p, x, y), position(p, x + side, y), position(p, x + side, y + side),
                      position(p, x, y + side)};
  }

  void trace_new() {
    const std::size_t first = traced_, count = map_.starts.size();
    map_.landings.resize(count * map_.nodes);
    map_.ends.resize(count * map_.nodes);
    map_.lengths.resize(count * tracer_.check_nodes().size());
    const std::size_t tasks = (count - first + task_size - 1) / task_size;
    std::atomic<std::size_t> done{first};
    const std::thread::id caller = std::this_thread::get_id();
    tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
      if (progress_.cancelled) throw Cancelled();
      const std::size_t begin = first + task * task_size, end = std::min(begin + task_size, count);
      std::vector<NewPosition> positions;
      for (std::size_t i = begin; i < end; ++i) positions.push_back({beam_.start(origins_[i]), parents_[i]});
      tracer_.trace(map_, begin, positions);
      const std::size_t traced = done += end - begin;
      if (std::this_thread::get_id() == caller)
        progress_.update("tracing rays", std::min(traced, settings_.most_starts), settings_.most_starts);
    });
    traced_ = count;
  }

  bool landed(std::uint32_t position, std::size_t node) const {
    return map_.ends[position * map_.nodes + node] == RayEnd::plate;
  }
  Eigen::Vector2f landing(std::uint32_t position, std::size_t node) const {
    return map_.landings[position * map_.nodes + node];
  }

  /// Where the light of some positions lands at one node.
  struct Reach {
    Eigen::Array2f low = Eigen::Array2f::Constant(std::numeric_limits<float>::infinity()), high = -low;  // Pixels.
    std::size_t landed = 0;  // Number of the positions whose light lands.
  };

  template <std::size_t count>
  Reach reach_of(const std::array<std::uint32_t, count>& positions, std::size_t node) const {
    Reach reach;
    for (const std::uint32_t position : positions) {
      if (!landed(position, node)) continue;
      ++reach.landed;
      reach.low = reach.low.min(landing(position, node).array());
      reach.high = reach.high.max(landing(position, node).array());
    }
    return reach;
  }

  bool is_on_plate(const Reach& reach) const {
    const Eigen::Array2f size = plate_.resolution.cast<float>().array();
    return reach.landed > 0 && (settings_.beside || ((reach.low < size).all() && (reach.high > 0).all()));
  }

  bool needs_division(const Square& square) const {
    if (square.level >= levels_) return false;
    if (square.level == 0) return true;  // There is no estimate of its error yet.
    bool is_seen = false;
    float size = 0;
    for (const std::size_t node : tracer_.check_nodes()) {
      const Reach reach = reach_of(square.corners, node);
      if (!is_on_plate(reach)) continue;
      if (reach.landed < 4) return true;
      is_seen = true;
      size = std::max(size, (reach.high - reach.low).maxCoeff());
    }
    return is_seen && square.error > settings_.tolerance * std::sqrt(std::max(size, 1.0f));
  }

  /// Divides the squares that need it, those with the greatest errors first if there are too many.
  /// @return whether there were any.
  bool divide_squares() {
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < squares_.size(); ++i)
      if (needs_division(squares_[i])) chosen.push_back(i);
    // A division adds up to five positions, and about three as neighbours share them.
    const std::size_t room = (settings_.most_starts - std::min(settings_.most_starts, map_.starts.size())) / 3;
    if (chosen.size() > room) {
      map_.is_complete = false;
      std::stable_sort(chosen.begin(), chosen.end(),
                       [&](std::size_t a, std::size_t b) { return squares_[a].error > squares_[b].error; });
      chosen.resize(room);
      std::sort(chosen.begin(), chosen.end());
    }
    if (chosen.empty()) return false;
    std::vector<std::array<std::uint32_t, 5>> added;  // The middles of the four sides, and of the square.
    for (const std::size_t i : chosen) added.push_back(middles_of(squares_[i]));
    trace_new();
    std::vector<Square> next;
    std::size_t done = 0;
    for (std::size_t i = 0; i < squares_.size(); ++i) {
      if (done == chosen.size() || chosen[done] != i) {
        next.push_back(squares_[i]);
        continue;
      }
      const float deviation = deviation_of(squares_[i], added[done++]);
      for (std::uint32_t quarter = 0; quarter < 4; ++quarter)
        next.push_back(quarter_of(squares_[i], quarter, deviation));
    }
    squares_ = std::move(next);
    return true;
  }

  bool is_on_border(const Square& square) const {
    const Patch& patch = patches_[square.patch];
    const std::uint32_t side = side_of(square), right = static_cast<std::uint32_t>(patch.columns) << levels_,
                        top = static_cast<std::uint32_t>(patch.rows) << levels_;
    return square.x == 0 || square.y == 0 || square.x + side == right || square.y + side == top;
  }

  std::array<std::uint32_t, 5> middles_of(const Square& square) {
    const std::uint32_t side = side_of(square), half = side / 2, x = square.x, y = square.y, p = square.patch;
    const auto& [a, b, c, d] = square.corners;
    // At the silhouette, landings are singular: neighbours say little about each other.
    const bool has_parents = !settings_.silhouette || !is_on_border(square);
    const auto middle = [&](std::uint32_t at_x, std::uint32_t at_y, const Parents& parents) {
      return position(p, at_x, at_y, has_parents ? parents : Parents());
    };
    return {middle(x + half, y, {{a, b}, 2}), middle(x + side, y + half, {{b, c}, 2}),
            middle(x + half, y + side, {{c, d}, 2}), middle(x, y + half, {{d, a}, 2}),
            middle(x + half, y + half, {{a, b, c, d}, 4})};
  }

  /// Where landings are smooth, the deviation falls to a quarter from level to level; at singular places, by less. The
  /// error of a square is what its own deviation will be if the last ratio stays.
  Square quarter_of(const Square& square, std::uint32_t quarter, float deviation) {
    const std::uint32_t half = side_of(square) / 2;
    Square part{square.patch, square.x + quarter % 2 * half, square.y + quarter / 2 * half, square.level + 1};
    const bool known = std::isfinite(deviation) && std::isfinite(square.deviation) && square.deviation > 0;
    part.deviation = deviation;
    part.error = deviation * (known ? std::clamp(deviation / square.deviation, 0.25f, 1.0f) : 1.0f);
    set_corners(part);
    return part;
  }

  /// The greatest distance, at a node, of a middle's landing from the mean of the corners beside it; infinite if some
  /// of the light does not land.
  float deviation_at(const std::array<std::uint32_t, 4>& corners, const std::array<std::uint32_t, 5>& middles,
                     std::size_t node) const {
    std::array<Eigen::Vector2f, 4> at;
    for (int i = 0; i < 4; ++i) {
      if (!landed(corners[i], node)) return std::numeric_limits<float>::infinity();
      at[i] = landing(corners[i], node);
    }
    float greatest = 0;
    for (int i = 0; i < 5; ++i) {
      if (!landed(middles[i], node)) return std::numeric_limits<float>::infinity();
      const Eigen::Vector2f mean =
          i < 4 ? Eigen::Vector2f((at[i] + at[(i + 1) % 4]) / 2) : Eigen::Vector2f((at[0] + at[1] + at[2] + at[3]) / 4);
      greatest = std::max(greatest, (landing(middles[i], node) - mean).norm());
    }
    return greatest;
  }

  /// The greatest deviation among the nodes whose light falls on the plate.
  float deviation_of(const Square& square, const std::array<std::uint32_t, 5>& middles) const {
    const auto& [a, b, c, d] = square.corners;
    const std::array<std::uint32_t, 9> all{a, b, c, d, middles[0], middles[1], middles[2], middles[3], middles[4]};
    float greatest = 0;
    for (const std::size_t node : tracer_.check_nodes())
      if (is_on_plate(reach_of(all, node))) greatest = std::max(greatest, deviation_at(square.corners, middles, node));
    return greatest;
  }

  /// Whether the map jumps across a side of a smallest square. The landings at its ends are then far apart, and those
  /// at the ends of the side's other half, in the parent, are not.
  bool is_torn(const Square& square) {
    if (square.level < levels_ || !(square.deviation > torn_pixels / 2)) return false;
    const std::uint32_t half = side_of(square), left = square.x / (2 * half) * 2 * half,
                        top = square.y / (2 * half) * 2 * half;
    std::array<std::array<std::uint32_t, 3>, 3> grid;  // The positions of the parent, by row and column.
    for (std::uint32_t row = 0; row < 3; ++row)
      for (std::uint32_t column = 0; column < 3; ++column)
        grid[row][column] = position(square.patch, left + column * half, top + row * half);
    const std::size_t x = (square.x - left) / half, y = (square.y - top) / half;
    for (const std::size_t i : {0, 1})
      if (is_torn(grid[y + i][x], grid[y + i][x + 1], grid[y + i][2 * (1 - x)], grid[y + i][1]) ||
          is_torn(grid[y][x + i], grid[y + 1][x + i], grid[2 * (1 - y)][x + i], grid[1][x + i]))
        return true;
    return false;
  }

  /// Whether the map jumps, at any node, between two positions, and not between the two of the next side.
  bool is_torn(std::uint32_t a, std::uint32_t b, std::uint32_t next_a, std::uint32_t next_b) const {
    for (std::size_t node = 0; node < map_.nodes; ++node) {
      if (!landed(a, node) || !landed(b, node) || !landed(next_a, node) || !landed(next_b, node)) continue;
      const float jump = (landing(a, node) - landing(b, node)).norm(),
                  next = (landing(next_a, node) - landing(next_b, node)).norm();
      if (jump > torn_pixels && jump > torn_ratio * next) return true;
    }
    return false;
  }

  /// Appends the positions on a side between two corners, without its end. They are there if a neighbour is finer.
  void add_side(const Square& square, std::uint32_t x0, std::uint32_t y0, std::uint32_t x1, std::uint32_t y1,
                std::uint32_t from, std::vector<std::uint32_t>& outline) const {
    const std::uint32_t x = (x0 + x1) / 2, y = (y0 + y1) / 2;
    const auto middle =
        (x != x0 || y != y0) && (x != x1 || y != y1) ? positions_.find(key(square.patch, x, y)) : positions_.end();
    if (middle == positions_.end()) {
      outline.push_back(from);
      return;
    }
    add_side(square, x0, y0, x, y, from, outline);
    add_side(square, x, y, x1, y1, middle->second, outline);
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
    const std::size_t checks = tracer_.check_nodes().size();
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
    const auto other = open_edges_.find(std::uint64_t{to} << 32 | from);
    if (other != open_edges_.end()) {
      map_.edges[other->second].against = triangle;
      open_edges_.erase(other);
      return;
    }
    open_edges_.emplace(std::uint64_t{from} << 32 | to, static_cast<std::uint32_t>(map_.edges.size()));
    map_.edges.push_back({from, to, triangle, FlowEdge::none});
  }

  /// Two triangles, or as many as the outline has sides if there are positions between the corners.
  void triangulate(const Square& square, const std::vector<std::uint32_t>& outline) {
    const bool torn = is_torn(square);
    if (outline.size() == 4) {
      const std::uint32_t first = add_triangle(outline[0], outline[1], outline[2], square.error, torn);
      const std::uint32_t second = add_triangle(outline[0], outline[2], outline[3], square.error, torn);
      map_.edges.push_back({outline[2], outline[0], first, second, true});
      for (std::size_t i = 0; i < 4; ++i) add_outline_edge(outline[i], outline[(i + 1) % 4], i < 2 ? first : second);
      return;
    }
    const std::uint32_t center = add_center(square);
    const auto first = static_cast<std::uint32_t>(map_.triangles.size()),
               count = static_cast<std::uint32_t>(outline.size());
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t from = outline[i], to = outline[(i + 1) % count];
      const std::uint32_t triangle = add_triangle(from, to, center, square.error, torn);
      add_outline_edge(from, to, triangle);
      map_.edges.push_back({to, center, triangle, first + (i + 1) % count});
    }
  }

  void make_triangles() {
    map_.triangles.reserve(3 * squares_.size());
    map_.edges.reserve(5 * squares_.size());
    open_edges_.reserve(3 * squares_.size());
    std::vector<std::uint32_t> outline;
    for (const Square& square : squares_) {
      const std::uint32_t x = square.x, y = square.y, side = side_of(square);
      const auto& [a, b, c, d] = square.corners;
      outline.clear();
      add_side(square, x, y, x + side, y, a, outline);
      add_side(square, x + side, y, x + side, y + side, b, outline);
      add_side(square, x + side, y + side, x, y + side, c, outline);
      add_side(square, x, y + side, x, y, d, outline);
      triangulate(square, outline);
    }
  }

  const Plate plate_;
  const Beam& beam_;
  const FlowSettings& settings_;
  const Progress& progress_;
  NodeTracer tracer_;
  std::vector<Patch> patches_;
  int levels_ = 1;  // Number of divisions from the first squares to the smallest ones.
  std::vector<Square> squares_;
  std::unordered_map<std::uint64_t, std::uint32_t> positions_;
  std::unordered_map<std::uint64_t, std::uint32_t> open_edges_;  // Edges with one triangle, by `from` and `to`.
  std::vector<Eigen::Vector2d> origins_;  // Where the rays of the positions start, in the beam's frame.
  std::vector<Parents> parents_;          // Of the positions.
  std::size_t traced_ = 0;                // Number of positions that have landings.
  FlowMap map_;
};

}  // namespace

int band_count(const FlowMap& map, int channels, const BandStep& step) {
  if (map.nodes == 1) return channels;
  std::vector<float> sweeps;
  for (std::size_t i = 0; i < map.starts.size(); ++i) {
    float sweep = 0;
    for (std::size_t node = 1; node < map.nodes; ++node) {
      const std::size_t at = i * map.nodes + node;
      if (map.ends[at] == RayEnd::plate && map.ends[at - 1] == RayEnd::plate)
        sweep += (map.landings[at] - map.landings[at - 1]).norm();
    }
    sweeps.push_back(sweep);
  }
  const auto place = static_cast<std::ptrdiff_t>(swept_share * static_cast<double>(sweeps.size() - 1));
  std::nth_element(sweeps.begin(), sweeps.begin() + place, sweeps.end());
  const double wanted = std::max<double>(step.least, sweeps[static_cast<std::size_t>(place)] / step.pixels);
  const double most = std::max(1.0, std::floor(static_cast<double>(step.most) / channels));
  return channels * static_cast<int>(std::clamp(std::ceil(wanted / channels), 1.0, most));
}

FlowMap trace_flow_map(const TensorField& field, const Geometry& geometry, const Plate& plate, const Beam& beam,
                       const BendingSettings& bending, const FlowSettings& settings, const Progress& progress) {
  if (settings.flexibilities.empty() || (settings.range && settings.flexibilities.size() != 2))
    throw std::invalid_argument("a flow map needs flexibilities, and a range has two");
  if (!(settings.tolerance > 0) || !(settings.finest > 0) || settings.most_starts < 1)
    throw std::invalid_argument("a flow map needs a tolerance and a number of positions greater than 0");
  return FlowMapBuilder(field, geometry, plate, beam, bending, settings, progress).build();
}

FlowMap trace_flow_map(const TensorField& field, const Geometry& geometry, const Beam& beam,
                       const BendingSettings& bending, const FlowSettings& settings, const Progress& progress) {
  if (!geometry.surfaces().plate) throw std::invalid_argument("a flow map needs a receiver");
  return trace_flow_map(field, extended(geometry), *geometry.surfaces().plate, beam, bending, settings, progress);
}

}  // namespace tensorray
