#include "tracing/flow/flow_vertices.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <utility>

#include <fmt/core.h>

#include "base/text/content_hash.h"

namespace tensorray {
namespace {

constexpr double inset = 3e-6;  // Rays from the aperture's edge start this part of a patch further inside: at the edge,
                                // rounding decides whether they enter the volume.
constexpr std::size_t task_size = 64;      // Vertices that one thread traces as one task.
constexpr std::size_t round_tasks = 4096;  // Whose landings ranks give each other at once (100 MB).

std::uint64_t hash_of(const void* values, std::size_t size, std::uint64_t before) {
  return content_hash({static_cast<const char*>(values), size}, before);
}

/// What the landings of a vertex at the start of a map depend on beside its place.
std::uint64_t hash_of_map(const Beam& beam, const FlowSettings& settings) {
  std::uint64_t hash = 0;
  const auto add = [&](const auto& values) { hash = hash_of(values.data(), values.size() * sizeof values[0], hash); };
  const Plate& plate = *settings.plate;
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
    : beam_(beam), settings_(settings), progress_(progress), tracer_(field, geometry, beam, bending, settings) {
  map_.wavelengths = tracer_.wavelengths();
  map_.check_step = tracer_.check_step();
  find_kept();
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
  const std::size_t first = traced_;
  const auto end_of = [&](std::size_t task) { return std::min(first + (task + 1) * task_size, count); };
  Units tasks;
  tasks.count = (count - first + task_size - 1) / task_size;
  tasks.for_all = true;
  tasks.round = round_tasks;
  tasks.make = [&](std::size_t task) { trace_vertices(first + task * task_size, end_of(task)); };
  tasks.copy = [&](std::size_t task, Archive& archive) {
    copy_landings(first + task * task_size, end_of(task), archive);
  };
  tasks.first = first / task_size;
  tasks.total = settings_.max_starts / task_size + 1;
  make_units(tasks, settings_.job, "tracing rays", progress_);
  traced_ = count;
}

void FlowVertices::trace_vertices(std::size_t begin, std::size_t end) {
  std::vector<NewVertex> vertices;
  for (std::size_t i = begin; i < end; ++i)
    if (!restore(i)) vertices.push_back({i, beam_.start(starts_[i].origin), starts_[i].parents});
  tracer_.trace(map_, vertices);
}

/// Copies the landings of vertices to or from bytes. @throw DamagedArchive if they cannot be those of light.
void FlowVertices::copy_landings(std::size_t begin, std::size_t end, Archive& archive) {
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

/// Of one vertex.
std::size_t FlowVertices::landing_bytes() const {
  return map_.wavelengths * (sizeof map_.landings[0] + sizeof map_.ends[0]) + map_.checks() * sizeof map_.lengths[0];
}

std::uint64_t FlowVertices::hash_of_landings(std::size_t vertex) const {
  const std::size_t first = vertex * map_.wavelengths;
  std::uint64_t hash = hash_of(&map_.landings[first], map_.wavelengths * sizeof map_.landings[0], 0);
  hash = hash_of(&map_.ends[first], map_.wavelengths * sizeof map_.ends[0], hash);
  return hash_of(&map_.lengths[vertex * map_.checks()], map_.checks() * sizeof map_.lengths[0], hash);
}

std::size_t FlowVertices::KeyHash::operator()(const VertexKey& key) const { return hash_of(&key, sizeof key, 0); }

VertexKey FlowVertices::key_of(std::size_t vertex) const {
  const auto& [origin, parents] = starts_[vertex];
  VertexKey key{};
  std::memcpy(key.data(), origin.data(), 2 * sizeof key[0]);
  // In their order: lengths are sums in this order. A vertex between the parts of two shards has the parents of either
  // quad, and each shard keeps it in its own way.
  for (std::size_t i = 0; i < parents.count; ++i) {
    const std::uint64_t hash = hash_of_landings(parents.vertices[i]);
    key[2] = hash_of(&hash, sizeof hash, key[2]);
  }
  return key;
}

std::string FlowVertices::name_of(std::size_t part) const {
  return fmt::format("flow map {:016x} {}", hash_of_map(beam_, settings_), part);
}

/// Finds the landings that earlier runs have kept of this map.
void FlowVertices::find_kept() {
  if (!settings_.job || !settings_.is_kept) return;
  const std::size_t bytes = landing_bytes();
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
bool FlowVertices::restore(std::size_t vertex) {
  if (kept_.empty()) return false;
  const auto found = kept_.find(key_of(vertex));
  if (found == kept_.end()) return false;
  Archive archive(found->second);
  copy_landings(vertex, vertex + 1, archive);
  return true;
}

void FlowVertices::keep() {
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

}  // namespace tensorray
