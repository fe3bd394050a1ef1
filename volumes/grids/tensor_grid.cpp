#include "volumes/grids/tensor_grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include <tbb/parallel_for.h>

#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

/// Whether all values are finite: only then is every product with zero a zero. Inactive voxels hold zero.
bool has_only_finite(const TensorBlock& block) {
  Eigen::Map<const Eigen::Array<float, 9 * TensorBlock::voxels, 1>> values(block.values[0].data());
  return (0.0f * values).sum() == 0;
}

int floor_to_block(int index) { return index - (index & (TensorBlock::size - 1)); }

void fill(TensorBlock& block, const Eigen::AlignedBox3i& box,
          const std::function<Eigen::Matrix3d(const Eigen::Vector3i&)>& value) {
  for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
    const Eigen::Vector3i index = block.origin + TensorBlock::position(offset);
    if (!box.contains(index)) continue;
    block.active.set(offset);
    block.values[offset] = value(index).cast<float>();
  }
}

}  // namespace

TensorBlocks make_blocks(std::size_t count) {
  SlotAllocator<TensorBlock>::prepare(count);
  return TensorBlocks(count);
}

std::size_t TensorGrid::active_voxels() const {
  std::size_t count = 0;
  for (const TensorBlock& block : blocks) {
    make_room();
    count += block.active.count();
  }
  return count;
}

Eigen::AlignedBox3i TensorGrid::active_box() const {
  Eigen::AlignedBox3i box;
  for (const TensorBlock& block : blocks) {
    make_room();
    const Eigen::Vector3i last = block.origin + Eigen::Vector3i::Constant(TensorBlock::size - 1);
    if (box.contains(block.origin) && box.contains(last)) continue;
    if (block.active.all()) {
      box.extend(block.origin).extend(last);
      continue;
    }
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset]) box.extend(Eigen::Vector3i(block.origin + TensorBlock::position(offset)));
  }
  return box;
}

TensorGrid dense_grid(const Eigen::AlignedBox3i& box, const Eigen::Affine3d& to_world,
                      const std::function<Eigen::Matrix3d(const Eigen::Vector3i&)>& value) {
  TensorGrid grid;
  grid.to_world = to_world;
  const Eigen::Vector3i first = box.min().unaryExpr(&floor_to_block);
  constexpr int size = TensorBlock::size;
  const Eigen::Vector3i count = (box.max() - first) / size + Eigen::Vector3i::Ones();
  grid.blocks = make_blocks(static_cast<std::size_t>(count.x()) * count.y() * count.z());
  const std::size_t slice = static_cast<std::size_t>(count.y()) * count.z();
  tbb::parallel_for(std::size_t{0}, grid.blocks.size(), [&](std::size_t i) {
    const Eigen::Vector3i block(static_cast<int>(i / slice), static_cast<int>(i / count.z() % count.y()),
                                static_cast<int>(i % count.z()));
    make_room();
    grid.blocks[i].origin = first + size * block;
    fill(grid.blocks[i], box, value);
  });
  return grid;
}

std::size_t remove_non_finite(TensorGrid& grid) {
  std::atomic<std::size_t> removed{0};
  tbb::parallel_for(std::size_t{0}, grid.blocks.size(), [&](std::size_t i) {
    make_room();
    TensorBlock& block = grid.blocks[i];
    if (has_only_finite(block)) return;
    const std::size_t before = block.active.count();
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      if (!block.active[offset] || block.values[offset].allFinite()) continue;
      block.values[offset].setZero();
      block.active.reset(offset);
    }
    removed += before - block.active.count();
  });
  grid.blocks.erase(std::remove_if(grid.blocks.begin(), grid.blocks.end(),
                                   [](const TensorBlock& block) {
                                     make_room();
                                     return block.active.none();
                                   }),
                    grid.blocks.end());
  return removed;
}

double asymmetry(const TensorGrid& grid) {
  struct Sums {
    double difference = 0, norm = 0;
  };
  std::vector<Sums> blocks(grid.blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
    make_room();
    const TensorBlock& block = grid.blocks[i];
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      if (!block.active[offset]) continue;
      const Eigen::Matrix3d tensor = block.values[offset].cast<double>();
      blocks[i].difference += (tensor - tensor.transpose()).squaredNorm();
      blocks[i].norm += tensor.squaredNorm();
    }
  });
  Sums all;  // Summed in the order of the blocks: the result does not depend on the number of threads.
  for (const Sums& block : blocks) {
    all.difference += block.difference;
    all.norm += block.norm;
  }
  return all.norm > 0 ? std::sqrt(all.difference / all.norm) : 0;
}

}  // namespace tensorray
