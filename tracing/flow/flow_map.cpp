#include "tracing/flow/flow_map.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include "base/geometry/box.h"
#include "base/process/job.h"
#include "base/text/content_hash.h"
#include "tracing/flow/cutoff.h"
#include "tracing/flow/flow_lattice.h"
#include "tracing/flow/wavelength_tracer.h"

namespace tensorray {
namespace {

constexpr double margin = 1.0 / 8;     // Extension of the plate on each side, in sizes of the plate.
constexpr double most_around = 64;     // First quads along the beam, of light beside its core: it is straight.
constexpr int edge_levels = 2;         // Divisions of first quads at the edge before their error is estimated.
constexpr float gathered_part = 0.5f;  // Where light is gathered, no less than this part of the tolerance is allowed.
constexpr int spared_levels = 1;       // The last divisions, where an edge leaves the range, or is by a side face.
constexpr float torn_deviation = 32;   // Pixels; a quad that has more may be torn.
constexpr float unknown = std::numeric_limits<float>::infinity();  // Deviation.
constexpr int max_levels = 14;
constexpr int block_size = 4;  // A shard has blocks of so many first quads along each side.

/// Vertices in the middles of a quad's sides, counter-clockwise from the lower one, and in its own.
using Middles = std::array<std::uint32_t, 5>;

/// What the landings of a vertex depend on, beside the map's settings: where its light starts, in the beam's frame.
using VertexKey = std::array<double, 2>;

template <class Values>
std::uint64_t hash_of(const Values& values, std::uint64_t before) {
  return content_hash({reinterpret_cast<const char*>(values.data()), values.size() * sizeof values[0]}, before);
}

/// What the landings of all vertices depend on, beside their places.
std::uint64_t hash_of_map(const Beam& beam, const FlowSettings& settings) {
  std::uint64_t hash = 0;
  const auto add = [&](const auto& values) { hash = hash_of(values, hash); };
  const Plate& plate = *settings.plate;
  add(std::array<double, 4>{settings.tolerance, static_cast<double>(settings.range), plate.size.x(), plate.size.y()});
  add(settings.flexibilities);
  add(plate.resolution);
  for (const Eigen::Vector3d& each :
       {plate.center, plate.right, plate.up, beam.center, beam.direction, beam.right, beam.up})
    add(each);
  return hash;
}

/// Adds vertices at points of a lattice, and traces their light: on all threads, with the ranks of the settings' job,
/// and only where it is not among the landings that the job keeps. Not to be used by two threads at once.
class FlowVertices {
 public:
  /// @param settings  With a plate. All arguments must outlive it.
  FlowVertices(const TensorField& field, const Geometry& geometry, const Beam& beam, const BendingSettings& bending,
               const FlowSettings& settings, const Progress& progress)
      : beam_(beam), settings_(settings), progress_(progress), tracer_(field, geometry, beam, bending, settings) {
    map_.wavelengths = tracer_.wavelengths();
    map_.check_step = tracer_.check_step();
    if (settings.job && settings.is_kept) find_kept();
  }

  /// The index of the vertex at a point of the finest lattice, which is added if it is not there.
  std::uint32_t at(std::uint32_t patch, std::uint32_t x, std::uint32_t y) {
    const auto [found, is_new] =
        lattice.vertices.emplace(FlowLattice::key(patch, x, y), static_cast<std::uint32_t>(map_.starts.size()));
    if (is_new) {
      const Patch& p = lattice.patches[patch];
      const double u = lattice.u_of(patch, x), v = lattice.v_of(patch, y);
      map_.starts.push_back(p.at(u, v));
      const double least = settings_.silhouette ? inset : 0;
      origins_.push_back(p.at(std::clamp(u, least, 1 - least), std::clamp(v, least, 1 - least)));
    }
    return found->second;
  }

  /// Traces the light of those that were added. @throw Cancelled; as Ranks::all_gather; DamagedArchive.
  void trace_new() {
    const std::size_t count = map_.starts.size(), first = traced_;
    map_.landings.resize(count * map_.wavelengths);
    map_.ends.resize(count * map_.wavelengths);
    map_.lengths.resize(count * map_.checks());
    const auto begin_of = [&](std::size_t task) { return std::min(first + task * task_size, count); };
    Units tasks;
    tasks.count = (count - first + task_size - 1) / task_size;
    tasks.for_all = true;
    tasks.round = round_tasks;
    tasks.make = [&](std::size_t task) { trace_vertices(begin_of(task), begin_of(task + 1)); };
    tasks.copy = [&](std::size_t task, Archive& to) { copy_landings(begin_of(task), begin_of(task + 1), to); };
    tasks.first = first / task_size;
    tasks.total = settings_.max_starts / task_size + 1;
    make_units(tasks, settings_.job, "tracing rays", progress_);
    traced_ = count;
  }

  /// Keeps the landings of all, if the map is kept, and is that of a shard or took long.
  void keep() {
    if (!settings_.job || !settings_.is_kept || !is_root(settings_.job->ranks)) return;
    if (!settings_.job->is_shard && !settings_.job->is_long()) return;
    Archive archive;
    for (std::size_t i = 0; i < traced_; ++i) {
      VertexKey key = key_of(i);
      archive.copy(key);
      copy_landings(i, i + 1, archive);
    }
    settings_.job->keep(name_of(settings_.job->part().index), archive.take());
  }

  const FlowMap& map() const { return map_; }  ///< Without triangles and edges.

  /// The map, with the numbers of rays.
  FlowMap take() {
    map_.rays = tracer_.rays();
    map_.ray_steps = tracer_.ray_steps();
    map_.tensor_samples = tracer_.tensor_samples();
    return std::move(map_);
  }

  FlowLattice lattice;

 private:
  static constexpr std::size_t task_size = 64;      // Vertices that one thread traces as one task.
  static constexpr std::size_t round_tasks = 4096;  // Whose landings ranks give each other at once (100 MB).
  // Rays from the aperture's edge start so far inside, in patches: there, rounding decides whether they enter the
  // volume.
  static constexpr double inset = 3e-6;

  struct KeyHash {
    std::size_t operator()(const VertexKey& key) const { return hash_of(key, 0); }
  };

  void trace_vertices(std::size_t begin, std::size_t end) {
    std::vector<NewVertex> vertices;
    for (std::size_t i = begin; i < end; ++i)
      if (!restore(i)) vertices.push_back({i, beam_.start(origins_[i])});
    tracer_.trace(map_, vertices);
  }

  /// Copies the landings of vertices to or from bytes. @throw DamagedArchive if they cannot be those of light.
  void copy_landings(std::size_t begin, std::size_t end, Archive& archive) {
    const auto copy = [&](auto& values, std::size_t of_each) {
      archive.copy(values.data() + begin * of_each, (end - begin) * of_each * sizeof values[0]);
    };
    copy(map_.landings, map_.wavelengths);
    copy(map_.ends, map_.wavelengths);
    copy(map_.lengths, map_.checks());
    if (!archive.reads()) return;
    for (std::size_t i = begin * map_.wavelengths; i < end * map_.wavelengths; ++i)
      if (static_cast<std::size_t>(map_.ends[i]) >= ray_end_count ||
          (map_.ends[i] == RayEnd::plate && !map_.landings[i].allFinite()))
        throw DamagedArchive();
  }

  VertexKey key_of(std::size_t vertex) const { return {origins_[vertex].x(), origins_[vertex].y()}; }

  std::string name_of(std::size_t part) const {
    return fmt::format("flow map {:016x} {}", hash_of_map(beam_, settings_), part);
  }

  /// Finds the landings that earlier runs have kept of this map.
  void find_kept() {
    const std::size_t bytes = map_.wavelengths * (sizeof map_.landings[0] + sizeof map_.ends[0]) +
                              map_.checks() * sizeof map_.lengths[0];  // Of one vertex.
    for (std::size_t part = 0; part < settings_.job->part().count; ++part) {
      const Result found = settings_.job->find(name_of(part));
      if (!found) continue;
      if (found->size() % (sizeof(VertexKey) + bytes) != 0) throw DamagedArchive();
      found_.push_back(found);
      for (std::string_view rest = *found; !rest.empty(); rest.remove_prefix(sizeof(VertexKey) + bytes)) {
        VertexKey key;
        std::memcpy(key.data(), rest.data(), sizeof key);
        kept_.emplace(key, rest.substr(sizeof key, bytes));
      }
    }
  }

  /// Takes the landings of a vertex from those that were kept. @return whether they are there.
  bool restore(std::size_t vertex) {
    if (kept_.empty()) return false;
    const auto found = kept_.find(key_of(vertex));
    if (found == kept_.end()) return false;
    Archive archive(found->second);
    copy_landings(vertex, vertex + 1, archive);
    return true;
  }

  const Beam& beam_;
  const FlowSettings& settings_;
  const Progress& progress_;
  WavelengthTracer tracer_;
  FlowMap map_;
  std::vector<Eigen::Vector2d> origins_;                           // Of the vertices' rays, in the beam's frame.
  std::size_t traced_ = 0;                                         // Number of vertices that have landings.
  std::vector<Result> found_;                                      // What the job has kept of this map.
  std::unordered_map<VertexKey, std::string_view, KeyHash> kept_;  // Landings in it.
};

class FlowMapBuilder {
 public:
  /// @param settings  With a plate.
  FlowMapBuilder(const TensorField& field, const Geometry& geometry, const Beam& beam, const BendingSettings& bending,
                 const FlowSettings& settings, const Progress& progress)
      : plate_(*settings.plate),
        beam_(beam),
        settings_(settings),
        vertices_(field, geometry, beam, bending, settings, progress) {
    const double pixel = pixel_of_starts(plate_, beam);
    const double size = first_size(field, beam, pixel, settings);
    lattice().patches = patches_of(core_of(beam), size);
    if (!beam.core.empty()) {
      const double around = std::max(size, box_of(beam.aperture).sizes().maxCoeff() / most_around);
      for (const Patch& patch : patches_around(beam.core, beam.aperture, around)) lattice().patches.push_back(patch);
    }
    lattice().is_graded = settings.silhouette;
    first_size_ = static_cast<float>(size / pixel);
    const double finest = std::min(settings.finest, settings.tolerance) * pixel;
    while (lattice().levels < max_levels && std::ldexp(size, -lattice().levels) > finest) ++lattice().levels;
  }

  FlowMap build() && {
    add_first_quads();
    vertices_.trace_new();
    while (divide_quads())
      if (settings_.show) settings_.show([&] { return with_triangles(map()); });
    vertices_.keep();
    FlowMap map = with_triangles(vertices_.take());
    map.is_complete = is_complete_;
    return map;
  }

 private:
  const FlowMap& map() const { return vertices_.map(); }
  FlowLattice& lattice() { return vertices_.lattice; }
  const FlowLattice& lattice() const { return vertices_.lattice; }

  void add_first_quads() {
    const std::uint32_t side = 1u << lattice().levels;
    for (std::uint32_t p = 0; p < lattice().patches.size(); ++p)
      for (std::uint32_t row = 0; row < static_cast<std::uint32_t>(lattice().patches[p].rows); ++row)
        for (std::uint32_t column = 0; column < static_cast<std::uint32_t>(lattice().patches[p].columns); ++column) {
          if (!is_in_part(row, column)) continue;
          const std::uint32_t x = column * side, y = row * side;
          Quad quad{p, x, y};
          quad.corners = {vertices_.at(p, x, y), vertices_.at(p, x + side, y), vertices_.at(p, x + side, y + side),
                          vertices_.at(p, x, y + side)};
          quads_.push_back(quad);
        }
  }

  /// Whether a first quad belongs to the part of this shard. Blocks of a shard are far apart, so that shards have
  /// nearly the same work.
  bool is_in_part(std::uint32_t row, std::uint32_t column) const {
    if (!settings_.job || !settings_.is_kept || !settings_.job->is_shard) return true;
    const WorkPart part = settings_.job->part();
    const std::size_t step = std::max<std::size_t>(1, part.count * 3 / 8);
    return (column / block_size + row / block_size * step) % part.count == part.index;
  }

  FlowMap with_triangles(FlowMap map) const {
    add_triangles(lattice(), quads_, beam_, map);
    return map;
  }

  /// Where the light of some vertices lands at one sample.
  struct Reach {
    Eigen::Array2f low = Eigen::Array2f::Constant(std::numeric_limits<float>::infinity()), high = -low;  // Pixels.
    std::size_t landed = 0;  // Number of the vertices whose light lands.
  };

  template <std::size_t count>
  Reach reach_of(const std::array<std::uint32_t, count>& vertices, std::size_t sample) const {
    Reach reach;
    for (const std::uint32_t vertex : vertices) {
      if (!map().landed(vertex, sample)) continue;
      ++reach.landed;
      reach.low = reach.low.min(map().landing(vertex, sample).array());
      reach.high = reach.high.max(map().landing(vertex, sample).array());
    }
    return reach;
  }

  bool is_on_plate(const Reach& reach) const {
    const Eigen::Array2f size = plate_.resolution.cast<float>().array();
    return reach.landed > 0 && (settings_.beside || ((reach.low < size).all() && (reach.high > 0).all()));
  }

  /// The lesser extent of a quad's light on the plate, pixels; 0 on a fold.
  float width_of(const Quad& quad, const Reach& reach, std::size_t sample) const {
    const auto& [a, b, c, d] = quad.corners;
    const Eigen::Vector2f up = map().landing(c, sample) - map().landing(a, sample),
                          down = map().landing(d, sample) - map().landing(b, sample);
    const float area = std::abs(up.x() * down.y() - up.y() * down.x()) / 2;
    return area > 0 ? area / (reach.high - reach.low).maxCoeff() : 0;
  }

  /// The error of landings that a quad may have, pixels. In a map that is drawn as light, the error moves light: of
  /// that, a larger quad has more, and it is seen less where it is spread over the plate, or by the range.
  /// @param extent  The greatest of the quad's landings, pixels.
  /// @param width   The least of the quad's light at any wavelength, pixels.
  /// @param sweep   The distance of its light from the first wavelength sample to the last, pixels.
  float error_bound(const Quad& quad, float extent, float width, float sweep) const {
    const float tolerance = static_cast<float>(settings_.tolerance), pixel = 1;
    if (!settings_.silhouette) return tolerance * std::sqrt(std::max(extent, pixel));
    const float size = std::ldexp(first_size_, -quad.level);
    if (!std::isfinite(width)) width = size;  // At each sample, a part of its light does not land.
    return tolerance * std::max(width / size, gathered_part) *
           std::cbrt(std::max(sweep / std::max(width, pixel), 1.0f));
  }

  bool needs_division(const Quad& quad) const {
    if (quad.level >= lattice().levels) return false;
    const bool is_at_edge = settings_.silhouette && lattice().is_at_edge(quad);
    if (quad.level < (is_at_edge ? edge_levels : 1)) return true;  // There is no estimate of its error yet.
    const ShadowEdge edge = edge_of(quad.corners);
    bool is_seen = false;
    float width = std::numeric_limits<float>::infinity(), extent = 0;
    Eigen::Vector2f first(0, 0), last(0, 0);
    for (std::size_t sample = 0; sample < map().wavelengths; sample += map().check_step) {
      const Reach reach = reach_of(quad.corners, sample);
      if (!is_on_plate(reach)) continue;
      if (reach.landed < 4 && (!edge.is_within || edge.by_side))
        return quad.level < lattice().levels - (edge.is_known || edge.by_side ? spared_levels : 0);
      extent = std::max(extent, (reach.high - reach.low).maxCoeff());
      if (reach.landed == 4) {
        last = map().landing(quad.corners[0], sample);
        if (!std::isfinite(width)) first = last;
        width = std::min(width, width_of(quad, reach, sample));
      }
      is_seen = true;
    }
    // Of light on a plate, the last division is for tears alone: of rough light, it shows hardly more.
    const bool is_torn = quad.deviation > torn_deviation && quad.deviation < unknown;
    if (settings_.silhouette && quad.level + 1 == lattice().levels && !is_torn) return false;
    return is_seen && quad.error > error_bound(quad, extent, width, settings_.range ? (last - first).norm() : 0);
  }

  /// The edge of a shadow between vertices. Maps that are not drawn as light have no use for it.
  template <std::size_t count>
  ShadowEdge edge_of(const std::array<std::uint32_t, count>& vertices) const {
    if (!settings_.silhouette || !map().is_range()) return {};
    return edge_between(cutoffs_of(map(), vertices).data(), count);
  }

  /// The quads that need division, or those with the greatest errors if they are too many.
  std::vector<std::size_t> choose_quads() {
    std::vector<std::uint8_t> needs(quads_.size());
    tbb::parallel_for(std::size_t{0}, quads_.size(), [&](std::size_t i) { needs[i] = needs_division(quads_[i]); });
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < quads_.size(); ++i)
      if (needs[i]) chosen.push_back(i);
    // A division adds up to five vertices, and about three as neighbours share them.
    const std::size_t room = (settings_.max_starts - std::min(settings_.max_starts, map().starts.size())) / 3;
    if (chosen.size() > room) {
      is_complete_ = false;
      std::stable_sort(chosen.begin(), chosen.end(),
                       [&](std::size_t a, std::size_t b) { return quads_[a].error > quads_[b].error; });
      chosen.resize(room);
      std::sort(chosen.begin(), chosen.end());
    }
    return chosen;
  }

  /// @return whether there were any.
  bool divide_quads() {
    const std::vector<std::size_t> chosen = choose_quads();
    std::vector<Middles> added;
    for (const std::size_t i : chosen) added.push_back(middles_of(quads_[i]));
    vertices_.trace_new();
    std::vector<float> deviations(chosen.size());
    tbb::parallel_for(std::size_t{0}, chosen.size(),
                      [&](std::size_t i) { deviations[i] = deviation_of(quads_[chosen[i]], added[i]); });
    std::vector<Quad> next;
    next.reserve(quads_.size() + 3 * chosen.size());
    auto from = quads_.begin();
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      const auto quad = quads_.begin() + static_cast<std::ptrdiff_t>(chosen[i]);
      next.insert(next.end(), from, quad);
      for (std::uint32_t quarter = 0; quarter < 4; ++quarter)
        next.push_back(quarter_of(*quad, quarter, added[i], deviations[i]));
      from = quad + 1;
    }
    next.insert(next.end(), from, quads_.end());
    quads_ = std::move(next);
    return !chosen.empty();
  }

  Middles middles_of(const Quad& quad) {
    const std::uint32_t side = lattice().side_of(quad), half = side / 2, x = quad.x, y = quad.y, p = quad.patch;
    return {vertices_.at(p, x + half, y), vertices_.at(p, x + side, y + half), vertices_.at(p, x + half, y + side),
            vertices_.at(p, x, y + half), vertices_.at(p, x + half, y + half)};
  }

  /// The error is what the part's own deviation will be if deviations go on to fall by the same ratio: to a quarter
  /// from level to level where landings are smooth, by less at singular places.
  Quad quarter_of(const Quad& quad, std::uint32_t quarter, const Middles& middles, float deviation) const {
    const std::uint32_t half = lattice().side_of(quad) / 2;
    const auto& [a, b, c, d] = quad.corners;
    const auto& [ab, bc, cd, da, center] = middles;
    Quad part{quad.patch, quad.x + quarter % 2 * half, quad.y + quarter / 2 * half, quad.level + 1};
    const bool known = std::isfinite(deviation) && std::isfinite(quad.deviation) && quad.deviation > 0;
    part.deviation = deviation;
    part.error = deviation * (known ? std::clamp(deviation / quad.deviation, 0.25f, 1.0f) : 1.0f);
    part.corners = std::array<std::array<std::uint32_t, 4>, 4>{
        {{a, ab, center, da}, {ab, b, bc, center}, {da, center, cd, d}, {center, bc, c, cd}}}[quarter];
    return part;
  }

  /// How far the landings of the middles are, at most, from what the corners beside them predict, at one wavelength
  /// sample. Where some light does not land, and the edge of its shadow is not within the quad, it is infinite, so that
  /// the quad's parts are divided again; but if only the last division is left, it is that of the known middles.
  float deviation_at(const Quad& quad, const Middles& middles, const ShadowEdge& edge, std::size_t sample) const {
    const bool is_last = settings_.silhouette && quad.level + 2 >= lattice().levels;
    std::array<Eigen::Vector2f, 4> at;
    at.fill(Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN()));
    for (std::size_t i = 0; i < 4; ++i) {
      const std::uint32_t corner = quad.corners[i];
      if (map().landed(corner, sample))
        at[i] = map().landing(corner, sample);
      else if (edge.is_within)
        at[i] = landing_beyond(map(), corner, static_cast<double>(sample), quad.corners.data(), 4).cast<float>();
      else if (!is_last)
        return unknown;
    }
    const auto [u, v] = middle_of(quad);
    const auto between = [](const Eigen::Vector2f& from, const Eigen::Vector2f& to, float part) {
      return Eigen::Vector2f((1 - part) * from + part * to);
    };
    const Eigen::Vector2f bottom = between(at[0], at[1], u), top = between(at[3], at[2], u);
    const std::array<Eigen::Vector2f, 5> expected{bottom, between(at[1], at[2], v), top, between(at[0], at[3], v),
                                                  between(bottom, top, v)};
    float greatest = -1;
    for (int i = 0; i < 5; ++i)
      if (map().landed(middles[i], sample))
        greatest = std::max(greatest, (map().landing(middles[i], sample) - expected[i]).norm());  // Not if it is NaN.
      else if (!edge.is_within && !is_last)
        return unknown;
    return greatest;
  }

  /// Where the middle of a quad lies in it; (½, ½) but at the aperture's edge.
  std::pair<float, float> middle_of(const Quad& quad) const {
    const std::uint32_t side = lattice().side_of(quad), half = side / 2;
    const auto part = [](double first, double middle, double last) {
      return static_cast<float>((middle - first) / (last - first));
    };
    const auto u = [&](std::uint32_t x) { return lattice().u_of(quad.patch, quad.x + x); };
    const auto v = [&](std::uint32_t y) { return lattice().v_of(quad.patch, quad.y + y); };
    return {part(u(0), u(half), u(side)), part(v(0), v(half), v(side))};
  }

  /// The greatest deviation among the samples whose light falls on the plate.
  float deviation_of(const Quad& quad, const Middles& middles) const {
    const auto& [a, b, c, d] = quad.corners;
    const std::array<std::uint32_t, 9> all{a, b, c, d, middles[0], middles[1], middles[2], middles[3], middles[4]};
    const ShadowEdge edge = edge_of(all);
    float greatest = -1;
    for (std::size_t sample = 0; sample < map().wavelengths; sample += map().check_step)
      if (is_on_plate(reach_of(all, sample))) greatest = std::max(greatest, deviation_at(quad, middles, edge, sample));
    return greatest < 0 ? unknown : greatest;
  }

  const Plate plate_;
  const Beam& beam_;
  const FlowSettings& settings_;
  FlowVertices vertices_;
  std::vector<Quad> quads_;
  float first_size_ = 1;  // Of the first quads, pixels of straight light.
  bool is_complete_ = true;
};

}  // namespace

FlowMap trace_flow_map(const TensorField& field, const Geometry& geometry, const Beam& beam,
                       const BendingSettings& bending, const FlowSettings& settings, const Progress& progress) {
  if (!settings.plate) {
    Surfaces extended = geometry.surfaces();
    if (!extended.plate) throw std::invalid_argument("a flow map needs a receiver");
    FlowSettings with_plate = settings;
    with_plate.plate = extended.plate;
    extended.plate->size *= 1 + 2 * margin;
    return trace_flow_map(field, Geometry(std::move(extended)), beam, bending, with_plate, progress);
  }
  if (settings.flexibilities.empty() || (settings.range && settings.flexibilities.size() != 2))
    throw std::invalid_argument("a flow map needs flexibilities, and a range has two");
  if (!(settings.tolerance > 0) || !(settings.finest > 0) || settings.max_starts < 1)
    throw std::invalid_argument("a flow map needs a tolerance and a number of positions greater than 0");
  return FlowMapBuilder(field, geometry, beam, bending, settings, progress).build();
}

}  // namespace tensorray
