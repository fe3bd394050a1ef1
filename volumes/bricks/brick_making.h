#pragma once
/// @file volumes/bricks/brick_making.h
/// Makes a TensorField's bricks of a grid's blocks.

#include <vector>

#include <Eigen/Geometry>

#include "volumes/bricks/brick_index.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// The blocks of a grid, found by where they are. Does not own them.
struct BlockTable {
  explicit BlockTable(const TensorGrid& grid);

  /// @param place  Of the block's first voxel, in steps of a block. @return nullptr if there is none.
  const TensorBlock* find(const Eigen::Vector3i& place) const {
    const std::uint32_t i = index.find(place);
    return i == BrickIndex::missing ? nullptr : blocks[i];
  }

  std::vector<Eigen::Vector3i> places;
  std::vector<const TensorBlock*> blocks;
  BrickIndex index;
};

/// The bricks of `extent` that hold an active voxel as a cell's corner, ordered by x, then y, then z: each block's own,
/// and where a voxel lies on a near face of it the one before it, whose apron shares that voxel.
std::vector<Eigen::Vector3i> active_bricks(const BlockTable& table, const Eigen::AlignedBox3i& extent);

/// Writes a brick's voxels, TensorBrick's way, over zeros. Reads the blocks at `brick` and the seven behind it.
/// @return TensorBrick::strongest.
float make_brick(const BlockTable& table, const Eigen::Vector3i& brick, float* floats);

}  // namespace tensorray
