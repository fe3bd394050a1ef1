#pragma once
/// @file volumes/files/stored_field.h
/// A tensor field in the grids of an OpenVDB file, of which one block at a time is read.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include <tbb/enumerable_thread_specific.h>

#include "volumes/files/file_bytes.h"
#include "volumes/files/vdb_leaves.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// A field whose leaves can be read in any order. Set `grids`, then call `find_blocks`.
struct StoredField {
  struct Grid {
    StoredTree tree;
    std::vector<StoredLeaf> leaves;
    std::vector<TensorEntry> entries;
  };
  std::filesystem::path path;
  FileBytes file;
  std::vector<Grid> grids;
  /// For each block of the field, and in it for each grid, the number of the leaf with its voxels; `missing`: none.
  std::vector<std::uint32_t> leaves;

  /// For each thread, a reader of each grid.
  mutable tbb::enumerable_thread_specific<std::vector<LeafReader>> readers;

  static constexpr std::uint32_t missing = 0xffffffffu;

  std::uint32_t leaf(std::size_t block, std::size_t grid) const { return leaves[block * grids.size() + grid]; }
  const StoredLeaf& leaf_of(std::size_t block, std::size_t grid) const { return grids[grid].leaves[leaf(block, grid)]; }
  std::size_t block_count() const { return leaves.size() / grids.size(); }

  explicit StoredField(const std::filesystem::path& p) : path(p), file(p) {}
};

/// The blocks of all grids, by their origins. Sets `leaves`.
std::vector<BlockShape> find_blocks(StoredField& field);

/// Reads the tensors of a block, whose number is that in the result of `find_blocks`. Any number of threads may call
/// it.
/// @throw std::runtime_error naming the file, if its voxels are damaged.
void fill_block(const StoredField& field, std::size_t i, TensorBlock& block);

}  // namespace tensorray
