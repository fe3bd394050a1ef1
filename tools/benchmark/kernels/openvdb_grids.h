#pragma once
/// @file tools/benchmark/kernels/openvdb_grids.h
/// Fields as OpenVDB grids in memory. Only the .cpp files that measure OpenVDB include this header, because OpenVDB's
/// headers are slow to compile.

#include <array>

#include <openvdb/openvdb.h>

#include "volumes/grids/tensor_grid.h"

namespace tensorray::benchmark {

/// A grid with the active voxels of the blocks, in index space. `value` converts a tensor to a value of the grid.
template <class Grid, class Value>
typename Grid::Ptr make_openvdb_grid(const TensorGrid& tensors, const Value& value) {
  typename Grid::Ptr grid = Grid::create();
  for (const TensorBlock& block : tensors.blocks) {
    auto* leaf = grid->tree().touchLeaf({block.origin.x(), block.origin.y(), block.origin.z()});
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset]) leaf->setValueOn(static_cast<openvdb::Index>(offset), value(block.values[offset]));
  }
  return grid;
}

inline std::array<openvdb::Vec3SGrid::Ptr, 3> make_openvdb_rows(const TensorGrid& tensors) {
  std::array<openvdb::Vec3SGrid::Ptr, 3> rows;
  for (int row = 0; row < 3; ++row)
    rows[row] = make_openvdb_grid<openvdb::Vec3SGrid>(
        tensors, [row](const Eigen::Matrix3f& T) { return openvdb::Vec3s(T(row, 0), T(row, 1), T(row, 2)); });
  return rows;
}

}  // namespace tensorray::benchmark
