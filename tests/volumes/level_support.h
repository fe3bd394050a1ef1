#pragma once
/// Grids of several levels.

#include <functional>

#include "tests/volumes/grid_support.h"
#include "volumes/grids/block_source.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

using Formula = std::function<Eigen::Matrix3d(const Eigen::Vector3d&)>;  ///< Of a position in voxels of level 0.
using Refines = std::function<bool(const Eigen::Vector3i&)>;             ///< Of a brick of the level before.

/// Appends a level: the voxels of the bricks that `refines` names, and those on the extent's last faces.
/// @param box  The voxels of level 0.
inline void add_level(TensorGrid& grid, const Eigen::AlignedBox3i& box, const Refines& refines, const Formula& value) {
  const int scale = 2 << grid.finer.size();
  const Eigen::AlignedBox3i extent(scale * box.min(), scale * box.max());
  TensorGrid level = dense_grid(extent, Eigen::Affine3d::Identity(),
                                [&](const Eigen::Vector3i& index) { return value(index.cast<double>() / scale); });
  clear_voxels(level.blocks, [&](const Eigen::Vector3i& index) {
    const Eigen::Vector3i cell = index.cwiseMin((extent.max().array() - 1).matrix().cwiseMax(extent.min()));
    return !refines(cell.unaryExpr([](int i) { return i >> 4; }));
  });
  grid.finer.push_back(std::move(level.blocks));
}

/// A grid of `levels` levels, each of which refines the same places of space.
/// @param refines  Of a position in voxels of level 0.
inline TensorGrid grid_of_levels(const Eigen::AlignedBox3i& box, int levels, const Refines& refines,
                                 const Formula& value, const Eigen::Affine3d& to_world = Eigen::Affine3d::Identity()) {
  TensorGrid grid =
      dense_grid(box, to_world, [&](const Eigen::Vector3i& index) { return value(index.cast<double>()); });
  for (int level = 1; level < levels; ++level)
    add_level(
        grid, box,
        [&](const Eigen::Vector3i& brick) { return refines(brick.unaryExpr([&](int i) { return i >> (level - 1); })); },
        value);
  return grid;
}

}  // namespace tensorray
