#include "volumes/making/level_grid.h"

#include <array>
#include <set>
#include <vector>

#include <tbb/parallel_for.h>

#include "volumes/bricks/brick_index.h"

namespace tensorray {
namespace {

using Eigen::AlignedBox3i;
using Eigen::Vector3i;

Vector3i half(const Vector3i& index) {
  return index.unaryExpr([](int i) { return i >> 1; });
}

Vector3i block_of(const Vector3i& voxel) {
  return voxel.unaryExpr([](int i) { return i >> 3; });
}

/// Finds blocks of a level.
class LevelBlocks {
 public:
  explicit LevelBlocks(const TensorBlocks& blocks) : blocks_(blocks) {
    std::vector<Vector3i> places;
    for (const TensorBlock& block : blocks) places.push_back(block_of(block.origin));
    index_ = BrickIndex(places);
  }

  const TensorBlock* find(const Vector3i& place) const {
    const std::uint32_t number = index_.find(place);
    return number == BrickIndex::missing ? nullptr : &blocks_[number];
  }

 private:
  const TensorBlocks& blocks_;
  BrickIndex index_;
};

/// The value at a voxel of a level, whichever level has it. @return whether there is one.
bool find_value(const std::vector<LevelBlocks>& levels, std::size_t level, const Vector3i& voxel,
                Eigen::Matrix3f& value) {
  if (const TensorBlock* const block = levels[level].find(block_of(voxel))) {
    const Vector3i at = voxel - block->origin;
    const auto offset = static_cast<std::size_t>(TensorBlock::offset(at.x(), at.y(), at.z()));
    value = block->values[offset];
    return block->active[offset];
  }
  if (level == 0) return false;
  const AlignedBox3i about(half(voxel), half(voxel + Vector3i::Ones()));
  Eigen::Matrix3f sum = Eigen::Matrix3f::Zero(), coarser;
  int count = 0;
  for (int x = about.min().x(); x <= about.max().x(); ++x)
    for (int y = about.min().y(); y <= about.max().y(); ++y)
      for (int z = about.min().z(); z <= about.max().z(); ++z)
        if (find_value(levels, level - 1, {x, y, z}, coarser)) {
          sum += coarser;
          ++count;
        }
  if (count > 0) value = sum / static_cast<float>(count);
  return count > 0;
}

/// The places of a level's blocks, and of those within `reach` of them, in the order of a grid.
std::set<std::array<int, 3>> places_about(const TensorBlocks& blocks, int reach, const AlignedBox3i& extent) {
  const Vector3i beside = Vector3i::Constant((reach + TensorBlock::size - 1) / TensorBlock::size);
  const Vector3i first = block_of(extent.min()), last = block_of(extent.max());
  std::set<std::array<int, 3>> places;
  for (const TensorBlock& block : blocks) {
    const Vector3i from = (block_of(block.origin) - beside).cwiseMax(first);
    const Vector3i to = (block_of(block.origin) + beside).cwiseMin(last);
    for (int x = from.x(); x <= to.x(); ++x)
      for (int y = from.y(); y <= to.y(); ++y)
        for (int z = from.z(); z <= to.z(); ++z) places.insert({x, y, z});
  }
  return places;
}

}  // namespace

TensorGrid level_grid(const TensorGrid& grid, int level, int reach) {
  const AlignedBox3i box = grid.active_box();
  const AlignedBox3i extent(box.min() * (1 << level), box.max() * (1 << level));
  std::vector<LevelBlocks> levels;
  for (const TensorBlocks* const blocks : levels_of(grid)) levels.emplace_back(*blocks);
  TensorGrid result;
  result.to_world = to_world_of_level(grid.to_world, level);
  for (const auto& place : places_about(grid.finer[static_cast<std::size_t>(level) - 1], reach, extent)) {
    result.blocks.emplace_back();
    result.blocks.back().origin = TensorBlock::size * Vector3i(place[0], place[1], place[2]);
  }
  tbb::parallel_for(std::size_t{0}, result.blocks.size(), [&](std::size_t i) {
    TensorBlock& block = result.blocks[i];
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      const Vector3i voxel = block.origin + TensorBlock::position(offset);
      Eigen::Matrix3f value;
      if (!extent.contains(voxel) || !find_value(levels, static_cast<std::size_t>(level), voxel, value)) continue;
      block.active.set(static_cast<std::size_t>(offset));
      block.values[static_cast<std::size_t>(offset)] = value;
    }
  });
  remove_empty_blocks(result.blocks);
  return result;
}

}  // namespace tensorray
