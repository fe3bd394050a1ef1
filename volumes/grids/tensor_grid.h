#pragma once
/// @file volumes/grids/tensor_grid.h
/// Tensors at the voxels of a sparse grid. Files hold it, generators make it, and preprocessing changes it. Tracing
/// needs a TensorField, which is built from it.

#include <array>
#include <bitset>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <string>

#include <Eigen/Geometry>

#include "volumes/grids/block_memory.h"

namespace tensorray {

/// 8³ voxels. The index of the first one is a multiple of 8 along each axis. Inactive voxels hold zero.
struct TensorBlock {
  static constexpr int size = 8;
  static constexpr int voxels = size * size * size;

  Eigen::Vector3i origin = Eigen::Vector3i::Zero();  ///< Index of the first voxel.
  std::bitset<voxels> active;
  std::array<Eigen::Matrix3f, voxels> values;  ///< World axes, (T V)_i = Σ_j T(i, j) V_j.

  TensorBlock() { values.fill(Eigen::Matrix3f::Zero()); }

  /// Offset of a voxel from its position in the block (0 to 7 along each axis): x slowest, z fastest, as in OpenVDB's
  /// leaves.
  static int offset(int x, int y, int z) { return (x * size + y) * size + z; }
  static Eigen::Vector3i position(int offset) { return {offset / (size * size), offset / size % size, offset % size}; }
};

/// A deque, so that blocks can be freed one by one while something else is made from them.
using TensorBlocks = std::deque<TensorBlock, SlotAllocator<TensorBlock>>;

/// `count` blocks without active voxels. Runs on all threads.
TensorBlocks make_blocks(std::size_t count);

/// A sparse grid of tensors. Plain data; voxel (i, j, k) has its centre at `to_world` * (i, j, k).
struct TensorGrid {
  std::string name = "tensor";
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();  ///< From index to world space; invertible.
  TensorBlocks blocks;                          ///< Each has at least one active voxel; ordered by origin (x, y, z).
  std::map<std::string, std::string> metadata;  ///< `tensorray:field`, `tensorray:units`, `tensorray:source`, ...

  std::size_t active_voxels() const;

  /// Index box from the least to the greatest active voxel; isEmpty() where there is none.
  Eigen::AlignedBox3i active_box() const;
};

/// A dense grid: `value(index)` at every index of `box` (inclusive), all active.
/// Runs on all threads: `value` is called from several at once.
TensorGrid dense_grid(const Eigen::AlignedBox3i& box, const Eigen::Affine3d& to_world,
                      const std::function<Eigen::Matrix3d(const Eigen::Vector3i&)>& value);

/// Sets voxels that are not finite to zero and inactive, so that light goes straight there, and removes blocks that
/// have no active voxel left. Runs on all threads.
/// @return the number of voxels that were not finite.
std::size_t remove_non_finite(TensorGrid& grid);

/// sqrt(Σ‖T − Tᵀ‖² / Σ‖T‖²) (Frobenius) over the active voxels: 0 where symmetric, 2 where antisymmetric. Runs on all
/// threads; the result does not depend on their number.
double asymmetry(const TensorGrid& grid);

/// A field whose `asymmetry` is below this counts as symmetric: rounding to single precision can cause that much.
constexpr double symmetric_tolerance = 1e-5;

}  // namespace tensorray
