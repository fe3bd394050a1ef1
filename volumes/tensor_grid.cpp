#include "volumes/tensor_grid.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

/// Calls `visit(block, offset)` for each active voxel.
template <class Grid, class Visit>
void for_each_active(Grid& grid, const Visit& visit) {
  for (auto& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset]) visit(block, offset);
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

std::size_t TensorGrid::active_voxels() const {
  std::size_t count = 0;
  for (const TensorBlock& block : blocks) count += block.active.count();
  return count;
}

Eigen::AlignedBox3i TensorGrid::active_box() const {
  Eigen::AlignedBox3i box;
  for (const TensorBlock& block : blocks) {
    const Eigen::Vector3i last = block.origin + Eigen::Vector3i::Constant(TensorBlock::size - 1);
    if (box.contains(block.origin) && box.contains(last)) continue;
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
  grid.blocks.resize(static_cast<std::size_t>(count.x()) * count.y() * count.z());
  const std::size_t slice = static_cast<std::size_t>(count.y()) * count.z();
  tbb::parallel_for(std::size_t{0}, grid.blocks.size(), [&](std::size_t i) {
    const Eigen::Vector3i block(static_cast<int>(i / slice), static_cast<int>(i / count.z() % count.y()),
                                static_cast<int>(i % count.z()));
    grid.blocks[i].origin = first + size * block;
    fill(grid.blocks[i], box, value);
  });
  return grid;
}

std::size_t remove_non_finite(TensorGrid& grid) {
  std::size_t removed = 0;
  for_each_active(grid, [&](TensorBlock& block, int offset) {
    if (block.values[offset].allFinite()) return;
    block.values[offset].setZero();
    block.active.reset(offset);
    ++removed;
  });
  grid.blocks.erase(std::remove_if(grid.blocks.begin(), grid.blocks.end(),
                                   [](const TensorBlock& block) { return block.active.none(); }),
                    grid.blocks.end());
  return removed;
}

double asymmetry(const TensorGrid& grid) {
  double difference = 0, norm = 0;
  for_each_active(grid, [&](const TensorBlock& block, int offset) {
    const Eigen::Matrix3d tensor = block.values[offset].cast<double>();
    difference += (tensor - tensor.transpose()).squaredNorm();
    norm += tensor.squaredNorm();
  });
  return norm > 0 ? std::sqrt(difference / norm) : 0;
}

}  // namespace tensorray
