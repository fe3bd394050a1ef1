#pragma once
/// Grids of several levels.

#include <functional>

#include "tests/volumes/grid_support.h"
#include "volumes/grids/block_source.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

using Formula = std::function<Matrix3d(const Vector3d&)>;  ///< Of a position in voxels of level 0.
using Refines = std::function<bool(const Vector3i&)>;      ///< Of a brick of the level before.

/// Appends a level: the voxels of the bricks that `refines` names, and those on the extent's last faces.
/// @param box  The voxels of level 0.
inline void add_level(TensorGrid& grid, const AlignedBox3i& box, const Refines& refines, const Formula& value) {
  const int scale = 2 << grid.finer.size();
  const AlignedBox3i extent(scale * box.min(), scale * box.max());
  TensorGrid level = dense_grid(extent, Affine3d::Identity(),
                                [&](const Vector3i& index) { return value(index.cast<double>() / scale); });
  clear_voxels(level.blocks, [&](const Vector3i& index) {
    const Vector3i cell = index.cwiseMin((extent.max().array() - 1).matrix().cwiseMax(extent.min()));
    return !refines(cell.unaryExpr([](int i) { return i >> 4; }));
  });
  grid.finer.push_back(std::move(level.blocks));
}

/// A grid of `levels` levels, each of which refines the same places of space.
/// @param refines  Of a position in voxels of level 0.
inline TensorGrid grid_of_levels(const AlignedBox3i& box, int levels, const Refines& refines, const Formula& value,
                                 const Affine3d& to_world = Affine3d::Identity()) {
  TensorGrid grid = dense_grid(box, to_world, [&](const Vector3i& index) { return value(index.cast<double>()); });
  for (int level = 1; level < levels; ++level) {
    const auto in_level_0 = [&](int i) { return i >> (level - 1); };
    add_level(
        grid, box, [&](const Vector3i& brick) { return refines(brick.unaryExpr(in_level_0)); }, value);
  }
  return grid;
}

}  // namespace tensorray
