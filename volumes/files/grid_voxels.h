#pragma once
/// The voxels of a grid of an OpenVDB file, block by block. Values of leaves are read from the file when a block needs
/// them; those of tiles are in memory.
/// Only .cpp files of this folder include this header: it includes all of OpenVDB.

#include <filesystem>
#include <vector>

#include "volumes/files/grid_layouts.h"
#include "volumes/grids/tensor_grid.h"
#include "volumes/tensors/finite_differences.h"
#include "volumes/vdb/vdb_archive.h"

namespace tensorray {

/// A grid, and the entries of a tensor, or of a vector, that its values are stored in.
struct FieldGrid {
  VdbGrid file;
  std::vector<TensorEntry> entries;
};

inline openvdb::Coord coord_of(const Eigen::Vector3i& index) { return {index.x(), index.y(), index.z()}; }

/// Checks that blocks fit in the memory that there is. A bound (--memory) is checked elsewhere.
/// @throw std::runtime_error naming the file.
void require_memory(const std::filesystem::path& path, std::size_t blocks, std::size_t block_bytes);

/// The blocks that have an active voxel in one of the grids, ordered by origin.
/// @param block_bytes  What a block will need in memory.
/// @throw std::runtime_error naming the file, if voxels are out of range or fit in no memory; std::bad_alloc.
std::vector<BlockShape> find_blocks(const std::filesystem::path& path, const std::vector<FieldGrid>& grids,
                                    std::size_t block_bytes);

/// Writes the values of the active voxels of a block, whose origin is set and whose values are zero. Any number of
/// threads may call it. @throw std::runtime_error naming the file, if the values are damaged.
void put_values(const std::filesystem::path& path, const std::vector<FieldGrid>& grids, TensorBlock& block);
void put_values(const std::filesystem::path& path, const std::vector<FieldGrid>& grids, SampleBlock& block);

}  // namespace tensorray
