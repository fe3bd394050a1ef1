#include "tracing/flow/ray_memory.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

constexpr std::size_t max_exits = std::size_t{1} << 20;  // Some 150 MiB.

}  // namespace

Geometry without_plate(const Geometry& geometry) {
  Surfaces surfaces = geometry.surfaces();
  surfaces.plate.reset();
  return Geometry(std::move(surfaces));
}

std::size_t RayMemory::Hash::operator()(const Key& key) const {
  std::uint64_t hash = 0;
  for (const double value : key) {
    std::uint64_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
  }
  return hash;
}

RayMemory::Key RayMemory::key_of(const RayBatch& batch, std::size_t ray) {
  const Eigen::Vector3d& start = batch.position[ray];
  return {start.x(), start.y(), start.z(), batch.flexibility[ray]};
}

bool RayMemory::serves(const TensorField& field, const Geometry& geometry, const Eigen::Vector3d& direction,
                       const BendingSettings& settings) {
  const Surfaces& surfaces = geometry.surfaces();
  if (!surfaces.plate || !surfaces.obstacles.empty() || std::isfinite(settings.max_length)) return false;
  double far = -Geometry::infinite;
  for (const Eigen::Vector3d& corner : field.corners()) far = std::max(far, corner.dot(direction));
  for (const Eigen::Vector3d& corner : surfaces.plate->corners())
    if (!(corner.dot(direction) > far)) return false;
  return true;
}

void RayMemory::trace(const TensorField& field, const Geometry& volume, const Geometry& geometry,
                      const BendingSettings& settings, RayBatch& batch) {
  RayBatch unknown;
  std::vector<std::size_t> numbers;
  batch.end.resize(batch.size());
  batch.length.resize(batch.size());
  batch.steps.assign(batch.size(), 0);
  const auto set = [&](std::size_t ray, const Exit& exit) {
    batch.position[ray] = exit.position;
    batch.direction[ray] = exit.direction;
    batch.length[ray] = exit.length;
    batch.end[ray] = exit.end;
    if (exit.end != RayEnd::missed) return;
    const auto hit = geometry.absorber(exit.position, exit.direction);
    if (!hit) return;
    batch.position[ray] += hit->distance * exit.direction;
    batch.length[ray] += hit->distance;
    batch.end[ray] = RayEnd::plate;
  };
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const auto found = exits_.find(key_of(batch, i));
    if (found != exits_.end()) {
      set(i, found->second);
      continue;
    }
    unknown.add(batch.position[i], batch.direction[i], batch.flexibility[i]);
    numbers.push_back(i);
  }
  if (numbers.empty()) return;
  std::vector<Key> keys;
  for (std::size_t i = 0; i < unknown.size(); ++i) keys.push_back(key_of(unknown, i));
  tensorray::trace(field, volume, settings, unknown);
  const bool has_room = exits_.size() < max_exits;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const Exit exit{unknown.position[i], unknown.direction[i], unknown.length[i], unknown.end[i]};
    if (has_room) exits_.emplace(keys[i], exit);
    set(numbers[i], exit);
    batch.steps[numbers[i]] = unknown.steps[i];
  }
  batch.tensor_samples += unknown.tensor_samples;
}

}  // namespace tensorray
