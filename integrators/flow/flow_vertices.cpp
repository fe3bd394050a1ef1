#include "integrators/flow/flow_vertices.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <tbb/parallel_for.h>

#include "base/process/work.h"

namespace tensorray {
namespace {

constexpr double inset = 3e-6;  // Rays from the aperture's edge start this part of a patch further inside: at the edge,
                                // rounding decides whether they enter the volume.
constexpr std::size_t task_size = 64;                 // Vertices that one thread traces as one task.
constexpr std::size_t round_size = 4096 * task_size;  // Vertices whose landings processes give each other in a message
                                                      // (100 MB), and that are kept together.

/// What the landings of a vertex at the start of a map depend on beside its place.
std::uint64_t hash_of_map(const Beam& beam, const FlowSettings& settings) {
  std::uint64_t hash = 0;
  const auto add = [&](const auto& values) { hash = hash_of(values.data(), values.size() * sizeof values[0], hash); };
  const Plate& plate = *settings.plate;
  if (settings.key != 0) add(std::array{settings.key});
  add(std::array<double, 4>{settings.tolerance, static_cast<double>(settings.range), plate.size.x(), plate.size.y()});
  add(settings.flexibilities);
  add(plate.resolution);
  for (const Eigen::Vector3d& each :
       {plate.center, plate.right, plate.up, beam.center, beam.direction, beam.right, beam.up})
    add(each);
  return hash;
}

}  // namespace

FlowVertices::FlowVertices(const TensorField& field, const Geometry& geometry, const Beam& beam,
                           const BendingSettings& bending, const FlowSettings& settings, const Progress& progress)
    : beam_(beam),
      settings_(settings),
      progress_(progress),
      tracer_(field, geometry, beam, bending, settings),
      map_hash_(hash_of_map(beam, settings)) {
  map_.wavelengths = tracer_.wavelengths();
  map_.check_step = tracer_.check_step();
}

FlowMap FlowVertices::take() {
  map_.rays = tracer_.rays();
  map_.ray_steps = tracer_.ray_steps();
  map_.tensor_samples = tracer_.tensor_samples();
  return std::move(map_);
}

std::uint32_t FlowVertices::at(std::uint32_t patch, std::uint32_t x, std::uint32_t y, const Parents& parents) {
  const auto [found, is_new] =
      lattice.vertices.emplace(FlowLattice::key(patch, x, y), static_cast<std::uint32_t>(map_.starts.size()));
  if (is_new) {
    const Patch& p = lattice.patches[patch];
    const double u = lattice.u_of(patch, x), v = lattice.v_of(patch, y);
    map_.starts.push_back(p.at(u, v));
    const double least = settings_.silhouette ? inset : 0;
    starts_.push_back({p.at(std::clamp(u, least, 1 - least), std::clamp(v, least, 1 - least)), parents});
  }
  return found->second;
}

void FlowVertices::trace_new() {
  const std::size_t count = map_.starts.size();
  map_.landings.resize(count * map_.wavelengths);
  map_.ends.resize(count * map_.wavelengths);
  map_.lengths.resize(count * map_.checks());
  while (traced_ < count) trace_round(std::min(traced_ + round_size, count));
}

/// Traces the next vertices, up to `end`.
void FlowVertices::trace_round(std::size_t end) {
  std::vector<std::uint8_t> is_traced((end - traced_ + task_size - 1) / task_size);
  try {
    trace_tasks(end, is_traced);
    if (settings_.team) exchange_landings(*settings_.team, end);
  } catch (const Cancelled&) {
    if (!settings_.kept) throw;
    for (std::size_t task = 0; task < is_traced.size(); ++task)
      if (is_traced[task]) add_kept(traced_ + task * task_size, std::min(traced_ + (task + 1) * task_size, end));
    keep();
    throw;
  }
  traced_ = end;
  if (settings_.kept && settings_.kept->is_due()) keep();
}

/// @param is_traced  One for each task: becomes true where this process has traced it.
void FlowVertices::trace_tasks(std::size_t end, std::vector<std::uint8_t>& is_traced) {
  std::atomic<std::size_t> done{traced_};
  const std::thread::id caller = std::this_thread::get_id();
  tbb::parallel_for(std::size_t{0}, is_traced.size(), [&](std::size_t task) {
    if (progress_.cancelled) throw Cancelled();
    if (!does_part(settings_.team, task)) return;
    const std::size_t first = traced_ + task * task_size, last = std::min(first + task_size, end);
    trace_vertices(first, last);
    is_traced[task] = 1;
    const std::size_t traced = done += last - first;
    if (std::this_thread::get_id() == caller)
      progress_.update("tracing rays", std::min(traced, settings_.most_starts), settings_.most_starts);
  });
}

void FlowVertices::trace_vertices(std::size_t begin, std::size_t end) {
  std::vector<NewVertex> vertices;
  for (std::size_t i = begin; i < end; ++i)
    if (!restore(i)) vertices.push_back({i, beam_.start(starts_[i].origin), starts_[i].parents});
  tracer_.trace(map_, vertices);
}

/// Copies the landings of vertices to or from bytes. @throw std::runtime_error if they cannot be those of light.
void FlowVertices::copy_landings(std::size_t begin, std::size_t end, PartBytes& bytes) {
  const auto copy = [&](auto& values, std::size_t of_each) {
    bytes.copy(&values[begin * of_each], (end - begin) * of_each * sizeof values[0]);
  };
  copy(map_.landings, map_.wavelengths);
  copy(map_.ends, map_.wavelengths);
  copy(map_.lengths, map_.checks());
  if (!bytes.reads()) return;
  for (std::size_t i = begin * map_.wavelengths; i < end * map_.wavelengths; ++i)
    if (static_cast<std::size_t>(map_.ends[i]) >= ray_end_count ||
        (map_.ends[i] == RayEnd::plate && !map_.landings[i].allFinite()))
      throw DamagedWork("the landings of light that were kept or sent are damaged; render it again");
}

/// Gives the others the landings of the vertices that this process has traced, up to `end`, and takes theirs.
void FlowVertices::exchange_landings(Team& team, std::size_t end) {
  const std::size_t tasks = (end - traced_ + task_size - 1) / task_size;
  exchange_parts(team, tasks, tasks, [&](std::size_t task, PartBytes& bytes) {
    const std::size_t first = traced_ + task * task_size;
    copy_landings(first, std::min(first + task_size, end), bytes);
  });
}

std::uint64_t FlowVertices::hash_of_landings(std::size_t vertex) const {
  const std::size_t first = vertex * map_.wavelengths;
  std::uint64_t hash = hash_of(&map_.landings[first], map_.wavelengths * sizeof map_.landings[0]);
  hash = hash_of(&map_.ends[first], map_.wavelengths * sizeof map_.ends[0], hash);
  return hash_of(&map_.lengths[vertex * map_.checks()], map_.checks() * sizeof map_.lengths[0], hash);
}

ResultKey FlowVertices::key_of(std::size_t vertex) const {
  const auto& [origin, parents] = starts_[vertex];
  ResultKey key{0, 0, map_hash_};
  std::memcpy(key.data(), origin.data(), 2 * sizeof key[0]);
  // In their order: lengths are sums in this order. A vertex between the parts of two shards has the parents of either
  // quad, and each shard keeps it in its own way.
  for (std::size_t i = 0; i < parents.count; ++i) {
    const std::uint64_t hash = hash_of_landings(parents.vertices[i]);
    key[2] = hash_of(&hash, sizeof hash, key[2]);
  }
  return key;
}

/// Takes the landings of a vertex from those that were kept. @return whether they are there.
bool FlowVertices::restore(std::size_t vertex) {
  if (!settings_.kept || !settings_.kept->has_any()) return false;
  const std::size_t size =
      map_.wavelengths * (sizeof map_.landings[0] + sizeof map_.ends[0]) + map_.checks() * sizeof map_.lengths[0];
  std::optional<std::string> values = settings_.kept->find(key_of(vertex), size);
  if (!values) return false;
  PartBytes bytes(std::move(*values));
  copy_landings(vertex, vertex + 1, bytes);
  return true;
}

void FlowVertices::add_kept(std::size_t begin, std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) {
    PartBytes bytes;
    copy_landings(i, i + 1, bytes);
    settings_.kept->add(key_of(i), bytes.take());
  }
}

void FlowVertices::keep() {
  if (!settings_.kept) return;
  add_kept(added_, traced_);
  added_ = traced_;
  settings_.kept->keep(false);
}

}  // namespace tensorray
