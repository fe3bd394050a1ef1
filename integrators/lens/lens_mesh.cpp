#include "integrators/lens/lens_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>
#include <tbb/task_arena.h>

namespace tensorray {
namespace {

constexpr double cell_pixels = 4;              // Size of a cell of the first lattice.
constexpr double most_cells = 4096;            // Limit of cells along each side, for any image.
constexpr double most_skew = 4;                // Limit of cells for each cell_pixels² pixels, where pixels are skewed.
constexpr double short_pixels = 1.0 / 4;       // Edges shorter than this in starts and landings are not halved.
constexpr double shortest_pixels = 1.0 / 16;   // Edges shorter than this in the starts are not halved.
constexpr std::size_t most_starts = 1u << 14;  // No edge is halved beyond so many more starts,
constexpr double starts_per_pixel = 4;         // plus so many for each pixel. A chaotic field could need any number.
constexpr double bend_pixels = 0.1;            // Greatest distance of landings from an edge.
constexpr double gap_pixels = 1;               // Greatest distance of landings that the Jacobians do not explain.
constexpr double torn_fraction = 0.5;          // Beyond this part of an edge's length, it is a tear.

using Triangle = std::array<std::uint32_t, 3>;

/// Measures lengths so that pixels are square: in units of which a pixel's smaller side has `pixel`.
struct PixelMetric {
  double pixel = 1;                                      // The smaller side of a pixel, world units.
  Eigen::Matrix2d starts = Eigen::Matrix2d::Identity();  // Maps directions in the plane of starts.
  Eigen::Vector2d landings = Eigen::Vector2d(1, 1);      // Factors on directions in the plane of landings.

  Eigen::Vector2d of_landings(const Eigen::Vector2d& along) const { return landings.cwiseProduct(along); }
};

PixelMetric metric_of(const LensMeshSettings& settings) {
  PixelMetric metric;
  metric.pixel = settings.pixel.minCoeff();
  metric.landings = metric.pixel * settings.pixel.cwiseInverse();
  // Lengths in square pixels do not depend on the rotation.
  if (settings.pixel.x() != settings.pixel.y()) metric.starts = metric.landings.asDiagonal() * settings.turn;
  return metric;
}

/// Number of cells of the first lattice. If pixels are skewed against the lattice, cells as short as a pixel's shorter
/// side would be many more than pixels. Then cells are larger, and are refined where needed.
Eigen::Array2i lattice_cells(const LensMeshSettings& settings, const PixelMetric& metric) {
  const Eigen::Vector2d lengths = metric.starts.colwise().norm();
  const double skew = lengths.prod() / std::abs(metric.starts.determinant());
  const double larger = std::sqrt(std::max(1.0, skew / most_skew));
  const Eigen::Array2d cells = settings.starts.sizes().cwiseProduct(lengths) / (cell_pixels * metric.pixel * larger);
  return cells.ceil().max(1).min(most_cells).cast<int>();
}

/// State of the refinement of a mesh.
struct MeshWork {
  const LensMap& map;
  double flexibility;
  const Progress& progress;
  const MeshReport& report;
  int rounds = 0;  // Rounds of refinement so far; their total is not known.

  void tell(double part_of_round) const {
    if (report) report(1 - std::exp2(-(rounds + part_of_round)));
  }
};

/// Traces the rays of `mesh` that have no landing yet.
void trace_new(MeshWork& work, LensMesh& mesh, TraceCounts& counts) {
  constexpr std::size_t task_size = 64;
  const std::size_t tasks_at_once = 64 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  const std::size_t first = mesh.landings.size(), count = mesh.starts.size() - first;
  mesh.landings.resize(mesh.starts.size());
  std::vector<TraceCounts> took((count + task_size - 1) / task_size);
  const auto trace_task = [&](std::size_t task) {
    if (work.progress.cancelled) throw Cancelled();
    const auto from = mesh.starts.begin() + static_cast<std::ptrdiff_t>(first + task * task_size);
    const auto to = mesh.starts.begin() + static_cast<std::ptrdiff_t>(first + std::min(count, (task + 1) * task_size));
    took[task] = work.map.trace({from, to}, {work.flexibility}, &mesh.landings[first + task * task_size]);
  };
  for (std::size_t task = 0; task < took.size(); task += tasks_at_once) {
    work.tell(static_cast<double>(task) / static_cast<double>(took.size()));
    tbb::parallel_for(task, std::min(task + tasks_at_once, took.size()), trace_task);
  }
  for (const TraceCounts& each : took) counts += each;
  ++work.rounds;
}

enum class Edge { fine, coarse, torn };

Edge judge(const LensLanding& a, const LensLanding& b, const Eigen::Vector2d& along, const PixelMetric& metric) {
  const bool a_landed = a.end == RayEnd::plate, b_landed = b.end == RayEnd::plate;
  if (!a_landed && !b_landed) return Edge::fine;
  if (a_landed != b_landed) return Edge::torn;
  const Eigen::Vector2d edge = b.at - a.at;
  const double pixel = metric.pixel, length = metric.of_landings(edge).norm();
  const double gap = metric.of_landings(edge - (a.jacobian + b.jacobian) / 2 * along).norm();
  if (!(gap <= std::max(gap_pixels * pixel, torn_fraction * length))) return Edge::torn;
  // Offset of the middle of the cubic that has these ends and slopes.
  const double bend = metric.of_landings((a.jacobian - b.jacobian) * along / 8).norm();
  return bend > bend_pixels * pixel || gap > gap_pixels * pixel ? Edge::coarse : Edge::fine;
}

Edge judge(const LensMesh& mesh, std::uint32_t a, std::uint32_t b, const PixelMetric& metric) {
  return judge(mesh.landings[a], mesh.landings[b], mesh.starts[b] - mesh.starts[a], metric);
}

/// Halves edges, round by round. If an edge of a triangle is halved, its longest edge is halved too, so that triangles
/// do not become needles (Rivara 1984).
class Refinement {
 public:
  Refinement(LensMesh& mesh, std::vector<Triangle>& triangles, const LensMeshSettings& settings,
             const Progress& progress)
      : mesh_(mesh), triangles_(triangles), settings_(settings), metric_(metric_of(settings)), progress_(progress) {
    most_starts_ = mesh.starts.size() + most_starts +
                   static_cast<std::size_t>(starts_per_pixel * settings.target.prod() / settings.pixel.prod());
  }

  /// Halves once each edge that needs it. @return false if there was none. New starts have no landings yet.
  bool halve() {
    if (mesh_.starts.size() > most_starts_) return false;
    number_edges();
    tbb::parallel_for(std::size_t{0}, edges_.size(), [&](std::size_t edge) {
      if (needs_halving(edges_[edge].first, edges_[edge].second)) middles_[edge] = unset;
    });
    while (mark_longest()) continue;
    const std::size_t before = mesh_.starts.size();
    std::vector<Triangle> next;
    next.reserve(triangles_.size());
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      Triangle middle{};
      for (int i = 0; i < 3; ++i) middle[i] = middle_of(edges_of_[t][i]);
      divide(triangles_[t], middle, next);
    }
    triangles_ = std::move(next);
    return mesh_.starts.size() > before;
  }

 private:
  // Values of middles_ without a vertex: the edge stays whole, or is to be halved.
  static constexpr std::uint32_t none = 0xffffffffu, unset = 0xfffffffeu;

  /// Numbers the edges in the order of their vertices. Both triangles of an edge get the same number.
  void number_edges() {
    if (progress_.cancelled) throw Cancelled();
    using Side = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;  // The two vertices; 3 · triangle + side.
    std::vector<Side> sides(3 * triangles_.size());
    for (std::size_t i = 0; i < sides.size(); ++i) {
      const std::uint32_t a = triangles_[i / 3][i % 3], b = triangles_[i / 3][(i + 1) % 3];
      sides[i] = {std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(i)};
    }
    tbb::parallel_sort(sides);
    edges_.clear();
    edges_of_.resize(triangles_.size());
    for (const auto& [a, b, i] : sides) {
      if (edges_.empty() || edges_.back() != std::pair(a, b)) edges_.emplace_back(a, b);
      edges_of_[i / 3][i % 3] = static_cast<std::uint32_t>(edges_.size() - 1);
    }
    middles_.assign(edges_.size(), none);
  }

  /// The number of the triangle's longest edge; of equally long ones, the first.
  std::uint32_t longest_edge(std::size_t triangle) const {
    const auto length = [&](int i) {
      const auto [a, b] = edges_[edges_of_[triangle][i]];
      return (metric_.starts * (mesh_.starts[a] - mesh_.starts[b])).squaredNorm();
    };
    int longest = 0;
    for (const int i : {1, 2})
      if (length(i) > length(longest)) longest = i;
    return edges_of_[triangle][longest];
  }

  /// Marks the longest edge of each triangle that has a marked edge. @return whether any edge was newly marked.
  bool mark_longest() {
    if (progress_.cancelled) throw Cancelled();
    bool changed = false;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const auto& edges = edges_of_[t];
      if (std::all_of(edges.begin(), edges.end(), [&](std::uint32_t edge) { return middles_[edge] == none; })) continue;
      std::uint32_t& middle = middles_[longest_edge(t)];
      if (middle != none) continue;
      middle = unset;
      changed = true;
    }
    return changed;
  }

  bool needs_halving(std::uint32_t a, std::uint32_t b) const {
    const LensLanding &from = mesh_.landings[a], &to = mesh_.landings[b];
    if (is_short(a, b)) return false;
    if (from.end == RayEnd::plate && to.end == RayEnd::plate) {
      const Eigen::Array2d edge = (settings_.target / 2 + settings_.pixel).array();
      const Eigen::Array2d low = from.at.cwiseMin(to.at).array(), high = from.at.cwiseMax(to.at).array();
      if ((low > edge).any() || (high < -edge).any()) return false;
    }
    return judge(mesh_, a, b, metric_) != Edge::fine;
  }

  /// Whether the edge is short in the starts and, for the ends that landed, in the landings.
  bool is_short(std::uint32_t a, std::uint32_t b) const {
    const Eigen::Vector2d along = mesh_.starts[b] - mesh_.starts[a];
    double length = (metric_.starts * along).norm();
    if (length < shortest_pixels * metric_.pixel) return true;
    for (const std::uint32_t end : {a, b})
      if (mesh_.landings[end].end == RayEnd::plate)
        length = std::max(length, metric_.of_landings(mesh_.landings[end].jacobian * along).norm());
    return length < short_pixels * metric_.pixel;
  }

  /// The vertex in the middle of an edge, the same for both triangles; `none` if the edge stays whole.
  std::uint32_t middle_of(std::uint32_t edge) {
    std::uint32_t& middle = middles_[edge];
    if (middle == unset) {
      middle = static_cast<std::uint32_t>(mesh_.starts.size());
      mesh_.starts.push_back((mesh_.starts[edges_[edge].first] + mesh_.starts[edges_[edge].second]) / 2);
    }
    return middle;
  }

  void divide(Triangle corner, Triangle middle, std::vector<Triangle>& into) const {
    const auto count = std::count_if(middle.begin(), middle.end(), [](std::uint32_t each) { return each != none; });
    // Rotates the triangle so that the first edge, or the first two, are the halved ones.
    while ((count == 1 && middle[0] == none) || (count == 2 && middle[2] != none)) {
      std::rotate(corner.begin(), corner.begin() + 1, corner.end());
      std::rotate(middle.begin(), middle.begin() + 1, middle.end());
    }
    const auto [a, b, c] = corner;
    const auto [ab, bc, ca] = middle;
    const auto add = [&](std::initializer_list<Triangle> parts) { into.insert(into.end(), parts); };
    if (count == 0) {
      add({corner});
    } else if (count == 1) {
      add({{a, ab, c}, {ab, b, c}});
    } else if (count == 3) {
      add({{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    } else if ((metric_.starts * (mesh_.starts[a] - mesh_.starts[bc])).norm() <
               (metric_.starts * (mesh_.starts[ab] - mesh_.starts[c])).norm()) {
      add({{ab, b, bc}, {a, ab, bc}, {a, bc, c}});
    } else {
      add({{ab, b, bc}, {a, ab, c}, {ab, bc, c}});
    }
  }

  LensMesh& mesh_;
  std::vector<Triangle>& triangles_;
  const LensMeshSettings& settings_;
  const PixelMetric metric_;
  const Progress& progress_;
  std::size_t most_starts_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges_;  // Vertices of each edge, the lesser first.
  std::vector<std::array<std::uint32_t, 3>> edges_of_;  // Edges of each triangle; edge i joins its corners i and i + 1.
  std::vector<std::uint32_t> middles_;                  // Middle vertex of each edge, none or unset.
};

std::vector<Triangle> lattice_triangles(int columns, int rows) {
  std::vector<Triangle> triangles;
  for (int y = 0; y + 1 < rows; ++y)
    for (int x = 0; x + 1 < columns; ++x) {
      const auto corner = static_cast<std::uint32_t>(y * columns + x), below = corner + static_cast<unsigned>(columns);
      triangles.push_back({corner, below, corner + 1});
      triangles.push_back({corner + 1, below, below + 1});
    }
  return triangles;
}

/// Makes the final triangles: those whose three rays landed and whose edges are not torn.
void finish(LensMesh& mesh, const std::vector<Triangle>& triangles, const PixelMetric& metric) {
  for (const LensLanding& landing : mesh.landings) mesh.mesh.vertices.push_back(landing.at);
  for (const Triangle& triangle : triangles) {
    const bool covered = std::all_of(triangle.begin(), triangle.end(), [&](std::uint32_t vertex) {
      return mesh.landings[vertex].end == RayEnd::plate && mesh.landings[vertex].at.allFinite();
    });
    const auto is_torn = [&](int i) { return judge(mesh, triangle[i], triangle[(i + 1) % 3], metric) == Edge::torn; };
    if (covered && !is_torn(0) && !is_torn(1) && !is_torn(2)) mesh.mesh.triangles.push_back(triangle);
  }
}

}  // namespace

LensMesh make_lens_mesh(const LensMap& map, double flexibility, const LensMeshSettings& settings, TraceCounts& counts,
                        const Progress& progress, const MeshReport& report) {
  const PixelMetric metric = metric_of(settings);
  const Eigen::Vector2d extent = settings.starts.sizes();
  const Eigen::Array2i cells = lattice_cells(settings, metric);
  LensMesh mesh;
  for (int y = 0; y <= cells.y(); ++y)
    for (int x = 0; x <= cells.x(); ++x)
      mesh.starts.emplace_back(settings.starts.min().array() +
                               Eigen::Array2d(x, y) / cells.cast<double>() * extent.array());
  std::vector<Triangle> triangles = lattice_triangles(cells.x() + 1, cells.y() + 1);
  MeshWork work{map, flexibility, progress, report};
  trace_new(work, mesh, counts);
  Refinement refinement(mesh, triangles, settings, progress);
  while (refinement.halve()) trace_new(work, mesh, counts);
  finish(mesh, triangles, metric);
  return mesh;
}

LensMesh lattice_mesh(std::vector<Eigen::Vector2d> starts, std::vector<LensLanding> landings, int columns, int rows,
                      double pixel) {
  LensMesh mesh;
  mesh.starts = std::move(starts);
  mesh.landings = std::move(landings);
  PixelMetric metric;
  metric.pixel = pixel;
  finish(mesh, lattice_triangles(columns, rows), metric);
  return mesh;
}

void SheetSearch::find(const Eigen::Vector2d& point, std::vector<Sheet>& sheets) const {
  thread_local std::vector<PlanarHit> hits;
  search_.find(point, hits);
  sheets.clear();
  for (const PlanarHit& hit : hits) {
    Sheet sheet;
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t vertex = mesh_.mesh.triangles[hit.triangle][i];
      sheet.start += hit.weights[i] * mesh_.starts[vertex];
      sheet.jacobian += hit.weights[i] * mesh_.landings[vertex].jacobian;
      sheet.length += hit.weights[i] * mesh_.landings[vertex].length;
    }
    const auto is_same = [&](const Sheet& other) { return (other.start - sheet.start).norm() < 1e-3 * pixel_; };
    if (std::none_of(sheets.begin(), sheets.end(), is_same)) sheets.push_back(sheet);
  }
}

}  // namespace tensorray
