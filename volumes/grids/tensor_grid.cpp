#include "volumes/grids/tensor_grid.h"

#include <atomic>
#include <cmath>

#include <tbb/parallel_for.h>

#include "volumes/grids/block_source.h"

namespace tensorray {
namespace {

/// Whether all values are finite: only then is every product with zero a zero. Inactive voxels hold zero.
bool has_only_finite(const TensorBlock& block) {
  Eigen::Map<const Eigen::Array<float, 9 * TensorBlock::voxels, 1>> values(block.values[0].data());
  return (0.0f * values).sum() == 0;
}

}  // namespace

TensorBlocks unset_blocks(std::size_t count) {
  TensorBlocks blocks;
  for (std::size_t i = 0; i < count; ++i) blocks.emplace_back(TensorBlock::Unset());
  return blocks;
}

TensorBlocks make_blocks(std::size_t count) {
  TensorBlocks blocks = unset_blocks(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { blocks[i].values.fill(Eigen::Matrix3f::Zero()); });
  return blocks;
}

std::size_t active_voxels(const std::vector<BlockShape>& shapes) {
  std::size_t count = 0;
  for (const BlockShape& shape : shapes) count += shape.active.count();
  return count;
}

Eigen::AlignedBox3i active_box(const std::vector<BlockShape>& shapes) {
  Eigen::AlignedBox3i box;
  for (const BlockShape& shape : shapes) {
    const Eigen::Vector3i last = shape.origin + Eigen::Vector3i::Constant(TensorBlock::size - 1);
    if (box.contains(shape.origin) && box.contains(last)) continue;
    if (shape.active.all()) {
      box.extend(shape.origin).extend(last);
      continue;
    }
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (shape.active[offset]) box.extend(Eigen::Vector3i(shape.origin + TensorBlock::position(offset)));
  }
  return box;
}

Eigen::Affine3d to_world_of_level(const Eigen::Affine3d& to_world, int level) {
  return to_world * Eigen::Scaling(std::ldexp(1.0, -level));
}

std::vector<BlockShape> shapes_of(const TensorBlocks& blocks) {
  std::vector<BlockShape> result(blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
    result[i] = {blocks[i].origin, blocks[i].active};
  });
  return result;
}

std::vector<TensorBlocks*> levels_of(TensorGrid& grid) {
  std::vector<TensorBlocks*> levels{&grid.blocks};
  for (TensorBlocks& blocks : grid.finer) levels.push_back(&blocks);
  return levels;
}

std::vector<const TensorBlocks*> levels_of(const TensorGrid& grid) {
  std::vector<const TensorBlocks*> levels{&grid.blocks};
  for (const TensorBlocks& blocks : grid.finer) levels.push_back(&blocks);
  return levels;
}

TensorGrid dense_grid(const Eigen::AlignedBox3i& box, const Eigen::Affine3d& to_world,
                      const std::function<Eigen::Matrix3d(const Eigen::Vector3i&)>& value) {
  return to_grid(dense_source(box, to_world, value));
}

std::size_t remove_non_finite(TensorBlock& block) {
  if (has_only_finite(block)) return 0;
  const std::size_t before = block.active.count();
  for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
    if (block.values[offset].allFinite()) continue;
    block.values[offset].setZero();
    block.active.reset(offset);
  }
  return before - block.active.count();
}

void remove_empty_blocks(TensorGrid& grid) {
  for (TensorBlocks* blocks : levels_of(grid)) remove_empty_blocks(*blocks);
}

std::size_t remove_non_finite(TensorGrid& grid) {
  std::atomic<std::size_t> removed{0};
  for (TensorBlocks* blocks : levels_of(grid))
    tbb::parallel_for(std::size_t{0}, blocks->size(),
                      [&](std::size_t i) { removed += remove_non_finite((*blocks)[i]); });
  remove_empty_blocks(grid);
  return removed;
}

void AsymmetrySums::add(const AsymmetrySums& other) {
  difference += other.difference;
  norm += other.norm;
}

double AsymmetrySums::asymmetry() const { return norm > 0 ? std::sqrt(difference / norm) : 0; }

AsymmetrySums asymmetry_sums(const TensorBlock& block) {
  AsymmetrySums sums;  // Inactive voxels hold zero.
  sums.norm = Eigen::Map<const Eigen::Array<float, 9 * TensorBlock::voxels, 1>>(block.values[0].data())
                  .cast<double>()
                  .square()
                  .sum();
  for (const Eigen::Matrix3f& T : block.values) {
    if (T(0, 1) == T(1, 0) && T(0, 2) == T(2, 0) && T(1, 2) == T(2, 1)) continue;
    sums.difference += (T - T.transpose()).cast<double>().squaredNorm();
  }
  return sums;
}

double asymmetry(const TensorGrid& grid) {
  AsymmetrySums all;  // Summed in the order of the blocks: the result does not depend on the number of threads.
  for (const TensorBlocks* blocks : levels_of(grid)) {
    std::vector<AsymmetrySums> sums(blocks->size());
    tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t i) { sums[i] = asymmetry_sums((*blocks)[i]); });
    for (const AsymmetrySums& block : sums) all.add(block);
  }
  return all.asymmetry();
}

}  // namespace tensorray
