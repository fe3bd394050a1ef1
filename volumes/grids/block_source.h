#pragma once
/// Tensors block by block: those of a file, a generator, an array or a grid. This is what fields are made of.

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// The blocks of a level.
struct BlockLevel {
  std::vector<BlockShape> shapes;  ///< Each has at least one active voxel; ordered by origin (x, y, z).
  std::function<void(std::size_t i, TensorBlock& block)> fill;  ///< As BlockSource::fill.
};

/// A sparse grid of tensors whose blocks are made when they are needed. Name, transform, metadata and surface are
/// those of a TensorGrid.
struct BlockSource {
  std::string name = "tensor";
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();
  std::vector<BlockShape> shapes;  ///< Each has at least one active voxel; ordered by origin (x, y, z).
  std::map<std::string, std::string> metadata;
  TriangleMesh surface;

  /// Writes the values of the active voxels of block i to `block`, whose shape is set and whose other voxels are zero.
  /// Any thread may call it, any number of times. @throw std::runtime_error that names the file.
  std::function<void(std::size_t i, TensorBlock& block)> fill;

  std::vector<BlockLevel> finer = {};  ///< TensorGrid::finer.
};

/// Empties `block`, and fills it with block i of `source`.
void read_block(const BlockSource& source, std::size_t i, TensorBlock& block);

/// The same from the shape of block i and what fills it (BlockSource::fill).
void read_block(const BlockShape& shape, const std::function<void(std::size_t, TensorBlock&)>& fill, std::size_t i,
                TensorBlock& block);

/// A dense grid: `value(index)` at every index of `box` (inclusive), all active. `value` may be called from several
/// threads at once.
BlockSource dense_source(const Eigen::AlignedBox3i& box, const Eigen::Affine3d& to_world,
                         const std::function<Eigen::Matrix3d(const Eigen::Vector3i&)>& value);

/// The blocks of a finer level in some bricks of the level before: all voxels there, also on the extent's last faces.
/// @param extent  Of the level's voxels.
std::vector<BlockShape> shapes_within(const std::vector<Eigen::Vector3i>& bricks, const Eigen::AlignedBox3i& extent);

/// The blocks of a grid, which must outlive them; or which they keep in memory.
BlockSource view_of(const TensorGrid& grid);
BlockSource source_of(TensorGrid grid);

/// All blocks in memory. Runs on all threads. @throw as `fill`.
TensorGrid to_grid(const BlockSource& source);

}  // namespace tensorray
