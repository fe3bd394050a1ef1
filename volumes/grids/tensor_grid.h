#pragma once
/// Tensors, or numbers, at the voxels of a sparse grid. Files hold them, generators make them, and preprocessing
/// changes them. Tracing needs a TensorField, which is built from it.

#include <algorithm>
#include <array>
#include <bitset>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "base/geometry/triangle_mesh.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {

/// 8³ voxels. The index of the first one is a multiple of 8 along each axis. Inactive voxels hold zero.
struct TensorBlock {
  static constexpr int size = 8;
  static constexpr int voxels = size * size * size;

  Eigen::Vector3i origin = Eigen::Vector3i::Zero();  ///< Index of the first voxel.
  std::bitset<voxels> active;
  std::array<Eigen::Matrix3f, voxels> values;  ///< World axes, (T V)_i = Σ_j T(i, j) V_j.

  struct Unset {};

  TensorBlock() { values.fill(Eigen::Matrix3f::Zero()); }
  explicit TensorBlock(Unset) {}  ///< Whoever makes it sets all values.

  /// Offset of a voxel from its position in the block (0 to 7 along each axis): x slowest, z fastest, as in OpenVDB's
  /// leaves.
  static int offset(int x, int y, int z) { return (x * size + y) * size + z; }
  static Eigen::Vector3i position(int offset) { return {offset / (size * size), offset / size % size, offset % size}; }
};

/// The place of a block, and which of its voxels are active.
struct BlockShape {
  Eigen::Vector3i origin = Eigen::Vector3i::Zero();
  std::bitset<TensorBlock::voxels> active;
};

std::size_t active_voxels(const std::vector<BlockShape>& shapes);

/// Index box from the least to the greatest active voxel; isEmpty() where there is none.
Eigen::AlignedBox3i active_box(const std::vector<BlockShape>& shapes);

/// Levels that a field may have.
constexpr int max_levels = 4;

using TensorBlocks = std::deque<TensorBlock, SlotAllocator<TensorBlock>>;

/// `count` blocks without active voxels; `unset_blocks`: blocks whose values are not set.
TensorBlocks make_blocks(std::size_t count);
TensorBlocks unset_blocks(std::size_t count);

/// From voxel indices of a level to world. @param to_world  Of level 0.
Eigen::Affine3d to_world_of_level(const Eigen::Affine3d& to_world, int level);

std::vector<BlockShape> shapes_of(const TensorBlocks& blocks);  ///< In their order.

/// A sparse grid of tensors. Plain data; voxel (i, j, k) has its centre at `to_world` * (i, j, k).
struct TensorGrid {
  std::string name = "tensor";
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();  ///< From index to world space; invertible.
  TensorBlocks blocks;                          ///< Each has at least one active voxel; ordered by origin (x, y, z).
  std::map<std::string, std::string> metadata;  ///< `tensorray:field`, `tensorray:units`, `tensorray:source`, ...
  TriangleMesh surface;  ///< Of the body that the field is in, closed, outwards, world; empty: none.

  /// The voxels of finer levels, where there are any: voxel (i, j, k) of level l, which is finer[l − 1], has its centre
  /// at `to_world` * (i, j, k) / 2^l. The field is refined in the bricks of 8³ cells of the level before in which a
  /// voxel of the level is active. What is outside of the bricks of the level before, or outside the extent of level
  /// 0, is left out.
  std::vector<TensorBlocks> finer = {};

  std::vector<BlockShape> shapes() const { return shapes_of(blocks); }  ///< Of level 0.
  std::size_t active_voxels() const { return tensorray::active_voxels(shapes()); }
  Eigen::AlignedBox3i active_box() const { return tensorray::active_box(shapes()); }
};

/// The blocks of all levels, the coarsest first.
std::vector<TensorBlocks*> levels_of(TensorGrid& grid);
std::vector<const TensorBlocks*> levels_of(const TensorGrid& grid);

/// Numbers at 8³ voxels, in the order of a TensorBlock. Inactive voxels hold zero.
struct ScalarBlock : BlockShape {
  std::array<float, TensorBlock::voxels> values{};
};

/// A sparse grid of numbers, computed from a tensor field, or from the light in it, for other programs. Plain data, as
/// a TensorGrid.
struct ScalarGrid {
  std::string name;
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();
  std::deque<ScalarBlock> blocks;
  bool fog = false;  ///< Whether values are a density that is zero in empty space (OpenVDB: fog volume).
  std::map<std::string, std::string> metadata;
};

/// A dense grid: `value(index)` at every index of `box` (inclusive), all active.
/// Runs on all threads: `value` is called from several at once.
TensorGrid dense_grid(const Eigen::AlignedBox3i& box, const Eigen::Affine3d& to_world,
                      const std::function<Eigen::Matrix3d(const Eigen::Vector3i&)>& value);

/// Removes blocks that have no active voxel: of a level, or of a ScalarGrid; of all levels.
template <class Blocks>
void remove_empty_blocks(Blocks& blocks) {
  const auto is_empty = [](const auto& block) { return block.active.none(); };
  blocks.erase(std::remove_if(blocks.begin(), blocks.end(), is_empty), blocks.end());
}
void remove_empty_blocks(TensorGrid& grid);

/// Sets voxels that are not finite to zero and inactive, so that light goes straight there, and removes blocks that
/// have no active voxel left, of all levels. Runs on all threads.
/// @return the number of voxels that were not finite.
std::size_t remove_non_finite(TensorGrid& grid);

/// The same for a block, which may then be without active voxels.
std::size_t remove_non_finite(TensorBlock& block);

/// Σ‖T − Tᵀ‖² and Σ‖T‖² (Frobenius) over active voxels.
struct AsymmetrySums {
  double difference = 0, norm = 0;

  void add(const AsymmetrySums& other);
  double asymmetry() const;  ///< sqrt(difference / norm): 0 where symmetric, 2 where antisymmetric.
};

AsymmetrySums asymmetry_sums(const TensorBlock& block);

/// The asymmetry of all active voxels, of all levels. Runs on all threads; the result does not depend on their number.
double asymmetry(const TensorGrid& grid);

/// A field whose `asymmetry` is below this counts as symmetric: rounding to single precision can cause that much.
constexpr double symmetric_tolerance = 1e-5;

}  // namespace tensorray
