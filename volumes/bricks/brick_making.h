#pragma once
/// @file volumes/bricks/brick_making.h
/// Makes the bricks of a TensorField from the blocks of a grid.

#include <vector>

#include <Eigen/Geometry>

#include "volumes/bricks/brick_index.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// Finds the blocks of a grid by their places. Does not own the blocks.
struct BlockTable {
  explicit BlockTable(const TensorGrid& grid);

  /// @param place  Index of the block's first voxel / 8.
  /// @return nullptr if there is no block.
  const TensorBlock* find(const Eigen::Vector3i& place) const {
    const std::uint32_t i = index.find(place);
    return i == BrickIndex::missing ? nullptr : blocks[i];
  }

  std::vector<Eigen::Vector3i> places;
  std::vector<const TensorBlock*> blocks;
  BrickIndex index;
};

/// The bricks within `extent` that have an active voxel at a corner of one of their cells, ordered by x, then y, then
/// z. Each block gives the brick at its place. An active voxel on a near face of a block also gives the preceding
/// brick, whose apron contains that voxel.
std::vector<Eigen::Vector3i> active_bricks(const BlockTable& table, const Eigen::AlignedBox3i& extent);

/// Writes the voxels of a brick in the layout of TensorBrick. `floats` must hold zeros. Reads the block at `brick` and
/// its seven following neighbours.
/// @return TensorBrick::strongest.
float make_brick(const BlockTable& table, const Eigen::Vector3i& brick, float* floats);

}  // namespace tensorray
