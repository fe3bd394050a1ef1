#include "tracing/flow/ray_memory.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tracing/trace/trace.h"

namespace tensorray {

bool RayMemory::serves(const TensorField& field, const Geometry& geometry, const Eigen::Vector3d& direction,
                       const BendingSettings& settings) {
  const Surfaces& surfaces = geometry.surfaces();
  if (!surfaces.plate || !surfaces.obstacles.empty() || std::isfinite(settings.max_length)) return false;
  const double far = depth_range(field, Eigen::Vector3d::Zero(), direction).far;
  const auto corners = surfaces.plate->corners();
  return std::all_of(corners.begin(), corners.end(), [&](const auto& corner) { return corner.dot(direction) > far; });
}

void RayMemory::trace(const TensorField& field, const Geometry& volume, const Geometry& geometry,
                      const BendingSettings& settings, RayBatch& batch) {
  constexpr std::size_t max_exits = std::size_t{1} << 20;  // Some 150 MiB.
  const auto key_of = [&](std::size_t ray) -> Key {
    const Eigen::Vector3d& start = batch.position[ray];
    return {start.x(), start.y(), start.z(), batch.flexibility[ray]};
  };
  std::vector<Exit> exits(batch.size());
  RayBatch unknown;
  std::vector<std::size_t> numbers;  // Of the unknown rays, in the batch.
  for (std::size_t i = 0; i < batch.size(); ++i) {
    if (const auto found = exits_.find(key_of(i)); found != exits_.end()) {
      exits[i] = found->second;
      continue;
    }
    unknown.add(batch.position[i], batch.direction[i], batch.flexibility[i]);
    numbers.push_back(i);
  }
  tensorray::trace(field, volume, settings, unknown);
  batch.tensor_samples += unknown.tensor_samples;
  batch.steps.assign(batch.size(), 0);
  const bool has_room = exits_.size() < max_exits;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    Exit& exit = exits[numbers[i]];
    exit = {unknown.position[i], unknown.direction[i], unknown.length[i], unknown.end[i]};
    if (has_room) exits_.emplace(key_of(numbers[i]), exit);
    batch.steps[numbers[i]] = unknown.steps[i];
  }
  batch.end.resize(batch.size());
  batch.length.resize(batch.size());
  for (std::size_t i = 0; i < batch.size(); ++i) {
    auto& [position, direction, length, end] = exits[i];
    if (end == RayEnd::missed)
      if (const auto hit = geometry.absorber(position, direction)) {
        position += hit->distance * direction;
        length += hit->distance;
        end = RayEnd::plate;
      }
    batch.position[i] = position;
    batch.direction[i] = direction;
    batch.length[i] = length;
    batch.end[i] = end;
  }
}

}  // namespace tensorray
