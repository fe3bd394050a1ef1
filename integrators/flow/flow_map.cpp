#include "integrators/flow/flow_map.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <thread>

#include <tbb/parallel_for.h>

#include "base/box.h"
#include "base/team.h"
#include "integrators/flow/flow_lattice.h"
#include "integrators/flow/flow_triangles.h"
#include "integrators/flow/node_tracer.h"

namespace tensorray {
namespace {

constexpr double margin = 1.0 / 8;  // Extension of the plate on each side, in sizes of the plate.

// The first squares are of the lesser of these two sizes, for the usual tolerance.
constexpr double first_pixels = 8;       // In pixels of straight light.
constexpr double first_voxels = 1;       // In voxels, so that no part of the field is missed; but not more squares for
constexpr double most_for_voxels = 64;   // this than so many along a side.
constexpr double usual_tolerance = 0.5;  // Pixels.

constexpr double inset = 3e-6;  // On the aperture's edge, it is a matter of rounding whether rays enter the volume.
                                // There they start this part of a patch further inside.
constexpr int edge_levels = 2;  // Light from the edge may go its own way within a part of a first square: there squares
                                // are divided so often before their error is estimated.
constexpr float gathered_part = 0.5f;  // Of the tolerance is left, at least, where light is gathered.
constexpr float still_pixels = 1;      // Light that moves by no more from the first node to the last is in one place.
constexpr double swept_share = 0.99;   // The part of the positions whose light moves slowly enough from band to band.
constexpr int most_levels = 14;
constexpr std::size_t task_size = 64;        // Positions that one thread traces as one task.
constexpr std::size_t tasks_at_once = 4096;  // Whose landings processes give each other in one message: 100 MB.

/// Positions in the middles of a square's sides, counter-clockwise from the lower one, and in its own.
using Middles = std::array<std::uint32_t, 5>;

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
    lattice_.patches = patches_of(beam.aperture, size);
    lattice_.is_graded = settings.silhouette;
    first_size_ = static_cast<float>(size / pixel);
    const double finest = std::min(settings.finest, settings.tolerance) * pixel;
    while (lattice_.levels < most_levels && std::ldexp(size, -lattice_.levels) > finest) ++lattice_.levels;
    lattice_.still_levels = is_light() && lattice_.levels < most_levels ? 1 : 0;
    lattice_.levels += lattice_.still_levels;
  }

  FlowMap build() && {
    add_first_squares();
    trace_new();
    while (divide_squares()) continue;
    add_triangles(lattice_, squares_, beam_, map_);
    map_.rays = tracer_.rays();
    map_.ray_steps = tracer_.ray_steps();
    map_.tensor_samples = tracer_.tensor_samples();
    return std::move(map_);
  }

 private:
  std::uint32_t position(std::uint32_t patch, std::uint32_t x, std::uint32_t y, const Parents& parents = {}) {
    const auto [found, is_new] =
        lattice_.positions.emplace(FlowLattice::key(patch, x, y), static_cast<std::uint32_t>(map_.starts.size()));
    if (is_new) {
      const Patch& p = lattice_.patches[patch];
      const double u = lattice_.u_of(patch, x), v = lattice_.v_of(patch, y);
      map_.starts.push_back(p.at(u, v));
      const double least = settings_.silhouette ? inset : 0;
      origins_.push_back(p.at(std::clamp(u, least, 1 - least), std::clamp(v, least, 1 - least)));
      parents_.push_back(parents);
    }
    return found->second;
  }

  void add_first_squares() {
    const std::uint32_t side = 1u << lattice_.levels;
    for (std::uint32_t p = 0; p < lattice_.patches.size(); ++p)
      for (std::uint32_t row = 0; row < static_cast<std::uint32_t>(lattice_.patches[p].rows); ++row)
        for (std::uint32_t column = 0; column < static_cast<std::uint32_t>(lattice_.patches[p].columns); ++column) {
          const std::uint32_t x = column * side, y = row * side;
          Square square{p, x, y};
          square.corners = {position(p, x, y), position(p, x + side, y), position(p, x + side, y + side),
                            position(p, x, y + side)};
          squares_.push_back(square);
        }
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
      if (!does_part(settings_.team, task)) return;
      const std::size_t begin = first + task * task_size, end = std::min(begin + task_size, count);
      std::vector<NewPosition> positions;
      for (std::size_t i = begin; i < end; ++i) positions.push_back({beam_.start(origins_[i]), parents_[i]});
      tracer_.trace(map_, begin, positions);
      const std::size_t traced = done += end - begin;
      if (std::this_thread::get_id() == caller)
        progress_.update("tracing rays", std::min(traced, settings_.most_starts), settings_.most_starts);
    });
    if (settings_.team) exchange_landings(*settings_.team, tasks);
    traced_ = count;
  }

  /// Gives the others the landings of the positions that this process has traced, and takes theirs.
  void exchange_landings(Team& team, std::size_t tasks) {
    const std::size_t checks = tracer_.check_nodes().size();
    exchange_parts(team, tasks, tasks_at_once, [&](std::size_t task, PartBytes& bytes) {
      const std::size_t begin = traced_ + task * task_size, end = std::min(begin + task_size, map_.starts.size());
      const auto copy = [&](auto& values, std::size_t of_each) {
        bytes.copy(&values[begin * of_each], (end - begin) * of_each * sizeof values[0]);
      };
      copy(map_.landings, map_.nodes);
      copy(map_.ends, map_.nodes);
      copy(map_.lengths, checks);
    });
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

  /// Whether the map is to be drawn as light. Otherwise it says what is seen at each place.
  bool is_light() const { return settings_.silhouette; }

  /// The lesser extent of a square's light on the plate, pixels; 0 on a fold.
  float width_of(const Square& square, const Reach& reach, std::size_t node) const {
    const auto& [a, b, c, d] = square.corners;
    const Eigen::Vector2f up = landing(c, node) - landing(a, node), down = landing(d, node) - landing(b, node);
    const float area = std::abs(up.x() * down.y() - up.y() * down.x()) / 2;
    return area > 0 ? area / (reach.high - reach.low).maxCoeff() : 0;
  }

  /// The error of landings that a square may have, pixels, where it says what is seen at a place.
  /// @param extent  The greatest of the square's landings, pixels.
  float place_bound(float extent) const {
    return static_cast<float>(settings_.tolerance) * std::sqrt(std::max(extent, 1.0f));
  }

  /// Likewise of a map that is drawn as light. The error moves light, of which a larger square has more, and is seen
  /// less where this light is spread over the plate. But the map also says where light of each place comes from.
  /// @param width  Of the square's light, the least of all nodes, pixels.
  /// @param sweep  The distance of its light from the first node to the last, pixels.
  float light_bound(const Square& square, float extent, float width, float sweep) const {
    const float size = std::ldexp(first_size_, -square.level), pixel = 1;
    const float bound = static_cast<float>(settings_.tolerance) * std::max(width / size, gathered_part);
    return std::min(bound, place_bound(extent)) * std::cbrt(std::max(sweep / std::max(width, pixel), 1.0f));
  }

  bool needs_division(const Square& square) const {
    if (square.level >= lattice_.levels) return false;
    const bool is_for_still_light = square.level >= lattice_.levels - lattice_.still_levels;
    const bool is_at_edge = settings_.silhouette && lattice_.is_at_edge(square);
    if (square.level < (is_at_edge ? edge_levels : 1)) return true;  // There is no estimate of its error yet.
    bool is_seen = false;
    float width = std::numeric_limits<float>::infinity(), extent = 0;
    Eigen::Vector2f first(0, 0), last(0, 0);
    for (const std::size_t node : tracer_.check_nodes()) {
      const Reach reach = reach_of(square.corners, node);
      if (!is_on_plate(reach)) continue;
      if (reach.landed < 4) return !is_for_still_light;
      width = std::min(width, width_of(square, reach, node));
      extent = std::max(extent, (reach.high - reach.low).maxCoeff());
      last = landing(square.corners[0], node);
      if (!is_seen) first = last;
      is_seen = true;
    }
    const float sweep = settings_.range ? (last - first).norm() : 0;
    if (!is_seen || (is_for_still_light && sweep > still_pixels)) return false;
    return square.error > (is_light() ? light_bound(square, extent, width, sweep) : place_bound(extent));
  }

  /// The squares that need division, or those with the greatest errors if they are too many.
  std::vector<std::size_t> choose_squares() {
    std::vector<std::uint8_t> needs(squares_.size());
    tbb::parallel_for(std::size_t{0}, squares_.size(), [&](std::size_t i) { needs[i] = needs_division(squares_[i]); });
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < squares_.size(); ++i)
      if (needs[i]) chosen.push_back(i);
    // A division adds up to five positions, and about three as neighbours share them.
    const std::size_t room = (settings_.most_starts - std::min(settings_.most_starts, map_.starts.size())) / 3;
    if (chosen.size() > room) {
      map_.is_complete = false;
      std::stable_sort(chosen.begin(), chosen.end(),
                       [&](std::size_t a, std::size_t b) { return squares_[a].error > squares_[b].error; });
      chosen.resize(room);
      std::sort(chosen.begin(), chosen.end());
    }
    return chosen;
  }

  /// @return whether there were any.
  bool divide_squares() {
    const std::vector<std::size_t> chosen = choose_squares();
    std::vector<Middles> added;
    for (const std::size_t i : chosen) added.push_back(middles_of(squares_[i]));
    trace_new();
    std::vector<float> deviations(chosen.size());
    tbb::parallel_for(std::size_t{0}, chosen.size(),
                      [&](std::size_t i) { deviations[i] = deviation_of(squares_[chosen[i]], added[i]); });
    std::vector<Square> next;
    next.reserve(squares_.size() + 3 * chosen.size());
    auto from = squares_.begin();
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      const auto square = squares_.begin() + static_cast<std::ptrdiff_t>(chosen[i]);
      next.insert(next.end(), from, square);
      for (std::uint32_t quarter = 0; quarter < 4; ++quarter)
        next.push_back(quarter_of(*square, quarter, added[i], deviations[i]));
      from = square + 1;
    }
    next.insert(next.end(), from, squares_.end());
    squares_ = std::move(next);
    return !chosen.empty();
  }

  Middles middles_of(const Square& square) {
    const std::uint32_t side = lattice_.side_of(square), half = side / 2, x = square.x, y = square.y, p = square.patch;
    const auto& [a, b, c, d] = square.corners;
    // At the silhouette, landings are singular: neighbours say little about each other.
    const bool has_parents = !settings_.silhouette || !lattice_.is_on_border(square);
    const auto middle = [&](std::uint32_t at_x, std::uint32_t at_y, const Parents& parents) {
      return position(p, at_x, at_y, has_parents ? parents : Parents());
    };
    return {middle(x + half, y, {{a, b}, 2}), middle(x + side, y + half, {{b, c}, 2}),
            middle(x + half, y + side, {{c, d}, 2}), middle(x, y + half, {{d, a}, 2}),
            middle(x + half, y + half, {{a, b, c, d}, 4})};
  }

  /// Where landings are smooth, the deviation falls to a quarter from level to level; at singular places, by less. The
  /// error of a square is what its own deviation will be if the last ratio stays.
  Square quarter_of(const Square& square, std::uint32_t quarter, const Middles& middles, float deviation) const {
    const std::uint32_t half = lattice_.side_of(square) / 2;
    const auto& [a, b, c, d] = square.corners;
    const auto& [ab, bc, cd, da, center] = middles;
    Square part{square.patch, square.x + quarter % 2 * half, square.y + quarter / 2 * half, square.level + 1};
    const bool known = std::isfinite(deviation) && std::isfinite(square.deviation) && square.deviation > 0;
    part.deviation = deviation;
    part.error = deviation * (known ? std::clamp(deviation / square.deviation, 0.25f, 1.0f) : 1.0f);
    part.corners = std::array<std::array<std::uint32_t, 4>, 4>{
        {{a, ab, center, da}, {ab, b, bc, center}, {da, center, cd, d}, {center, bc, c, cd}}}[quarter];
    return part;
  }

  /// The greatest distance, at a node, of a middle's landing from what the corners beside it predict; infinite if some
  /// of the light does not land.
  float deviation_at(const Square& square, const Middles& middles, std::size_t node) const {
    std::array<Eigen::Vector2f, 4> at;
    for (int i = 0; i < 4; ++i) {
      if (!landed(square.corners[i], node)) return std::numeric_limits<float>::infinity();
      at[i] = landing(square.corners[i], node);
    }
    const auto [u, v] = middle_of(square);
    const auto between = [](const Eigen::Vector2f& from, const Eigen::Vector2f& to, float part) {
      return Eigen::Vector2f((1 - part) * from + part * to);
    };
    const Eigen::Vector2f bottom = between(at[0], at[1], u), top = between(at[3], at[2], u);
    const std::array<Eigen::Vector2f, 5> expected{bottom, between(at[1], at[2], v), top, between(at[0], at[3], v),
                                                  between(bottom, top, v)};
    float greatest = 0;
    for (int i = 0; i < 5; ++i) {
      if (!landed(middles[i], node)) return std::numeric_limits<float>::infinity();
      greatest = std::max(greatest, (landing(middles[i], node) - expected[i]).norm());
    }
    return greatest;
  }

  /// Where the middle of a square lies in it; (½, ½) but at the aperture's edge.
  std::pair<float, float> middle_of(const Square& square) const {
    const std::uint32_t side = lattice_.side_of(square), half = side / 2;
    const auto part = [](double first, double middle, double last) {
      return static_cast<float>((middle - first) / (last - first));
    };
    const auto u = [&](std::uint32_t x) { return lattice_.u_of(square.patch, square.x + x); };
    const auto v = [&](std::uint32_t y) { return lattice_.v_of(square.patch, square.y + y); };
    return {part(u(0), u(half), u(side)), part(v(0), v(half), v(side))};
  }

  /// The greatest deviation among the nodes whose light falls on the plate.
  float deviation_of(const Square& square, const Middles& middles) const {
    const auto& [a, b, c, d] = square.corners;
    const std::array<std::uint32_t, 9> all{a, b, c, d, middles[0], middles[1], middles[2], middles[3], middles[4]};
    float greatest = 0;
    for (const std::size_t node : tracer_.check_nodes())
      if (is_on_plate(reach_of(all, node))) greatest = std::max(greatest, deviation_at(square, middles, node));
    return greatest;
  }

  const Plate plate_;
  const Beam& beam_;
  const FlowSettings& settings_;
  const Progress& progress_;
  NodeTracer tracer_;
  FlowLattice lattice_;
  std::vector<Square> squares_;
  std::vector<Eigen::Vector2d> origins_;  // Where the rays of the positions start, in the beam's frame.
  std::vector<Parents> parents_;          // Of the positions.
  float first_size_ = 1;                  // Of the first squares, pixels of straight light.
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
