#pragma once
/// @file volumes/files/vdb_tree_check.h
/// Checks that the lengths in a stored OpenVDB tree fit the tree and the file. OpenVDB does not check them: it
/// allocates memory for the values that a chunk should have, and then writes as many bytes as the chunk claims to
/// have.

#include <bitset>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "volumes/files/file_bytes.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// How a file stores a tree.
struct StoredTree {
  std::string type;          ///< "Tree_vec3s_5_4_3".
  bool half = false;         ///< Values of voxels are 16-bit floats.
  bool blosc = false;        ///< Chunks of values are compressed by Blosc.
  bool zip = false;          ///< If `blosc` is false: chunks of values are compressed by zlib.
  bool active_only = false;  ///< Chunks may leave out inactive values.
};

/// A leaf, which has the voxels of a TensorBlock, and where the file has its values.
struct StoredLeaf {
  Eigen::Vector3i origin;
  std::bitset<TensorBlock::voxels> active;
  std::int64_t at = 0;     ///< Position of the flag before its values. The mask of its voxels is before the flag.
  std::int32_t bytes = 0;  ///< From the flag on.
  std::int8_t flag = 0;

  static constexpr std::int64_t mask_bytes = TensorBlock::voxels / 8;
};

struct StoredLeaves {
  std::vector<StoredLeaf> leaves;  ///< In the file's order.
  bool complete = false;           ///< Whether all active voxels are in leaves, and none in tiles.
};

/// What a file says of a grid's leaves in their order, so that they are found without reading through all of them
/// (metadata "file_delayed_load").
struct LeafTable {
  std::vector<std::int8_t> flags;
  std::vector<std::int64_t> chunks;  ///< Bytes of the values, with the length before them.
};

/// Reads through a tree whose topology begins at position `at`, and through the values that follow it. Only for files
/// of OpenVDB 3 (format 222) and later. It accepts without a check trees of other types than float, double, vec3s and
/// vec3d with nodes of 5, 4 and 3, and finds no leaves in them.
/// @return whether all lengths fit.
bool tree_fits(const FileBytes& file, std::int64_t at, const StoredTree& tree, StoredLeaves& leaves);

/// The same, but does not read the values where `table` fits a tree that ends at position `end`. Then lengths are to be
/// checked when leaves are read.
bool tree_fits(const FileBytes& file, std::int64_t at, std::int64_t end, const LeafTable& table, const StoredTree& tree,
               StoredLeaves& leaves);

/// Whether a file's table says the same as its leaves, which were read through, in what OpenVDB takes from the table:
/// not the flags in trees with all values, and nothing of a leaf of 16-bit floats without active voxels.
bool agrees(const LeafTable& table, const StoredTree& tree, const std::vector<StoredLeaf>& leaves);

/// The table of leaves that were read through.
LeafTable table_of(const StoredTree& tree, const std::vector<StoredLeaf>& leaves);

/// Active voxels, from a mask of a file.
std::bitset<TensorBlock::voxels> voxel_mask(const char* bytes);

/// What a leaf leaves out, and what follows the flag before its values.
enum NodeFlag : int {
  no_mask = 0,
  no_mask_minus_background = 1,
  no_mask_one_value = 2,
  mask_no_value = 3,
  mask_one_value = 4,
  mask_two_values = 5,
  all_values = 6
};

/// Bytes of a value in memory, and in a file with 16-bit floats.
struct ValueSize {
  std::int64_t full, half;
};

/// Nothing for a type that tree_fits does not check.
std::optional<ValueSize> value_size(const std::string& type);

/// Bytes between the flag before the values of a node of `count` values and these values.
std::int64_t bytes_behind_flag(int flag, const ValueSize& size, std::size_t count);

/// Whether the lengths in the value of a grid's metadata "file_delayed_load" fit. OpenVDB unpacks this value when it
/// reads the metadata.
bool delayed_load_fits(const std::string& value, std::int64_t file_size);

/// The value of these metadata, not packed, so that its length depends on the number of leaves alone.
std::string leaf_table_text(const LeafTable& table);

/// The table in a value that fits. Nothing if it does not say lengths.
std::optional<LeafTable> read_leaf_table(const std::string& value);

/// Whether a Blosc chunk that begins with `header` (16 bytes) has a length of `stored` bytes, and unpacks to
/// `expected` bytes.
bool blosc_fits(const char* header, std::int64_t stored, std::int64_t expected);

}  // namespace tensorray
