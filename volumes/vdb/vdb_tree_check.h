#pragma once
/// Checks that the lengths in a stored OpenVDB tree fit the tree and the file. OpenVDB does not check them: it
/// allocates memory for the values that a chunk should have, and then writes as many bytes as the chunk claims to
/// have.

#include <bitset>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/files/descriptor.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// An open file. Any number of threads may read it at once.
class FileBytes {
 public:
  /// @throw std::runtime_error naming the file and the reason.
  explicit FileBytes(const std::filesystem::path& path);

  std::int64_t size() const { return size_; }

  /// Copies `count` bytes from position `at` on. @return false if the file does not have them, or cannot be read.
  bool read(std::int64_t at, void* bytes, std::size_t count) const;

 private:
  Descriptor file_;
  std::int64_t size_ = 0;
};

/// Thrown where a file has less bytes than are needed, or lengths in it do not fit.
struct FormatError {};

/// How a file stores a tree.
struct StoredTree {
  std::string type;          ///< "Tree_vec3s_5_4_3".
  bool half = false;         ///< Values of voxels are 16-bit floats.
  bool blosc = false;        ///< Chunks of values are compressed by Blosc.
  bool zip = false;          ///< If `blosc` is false: chunks of values are compressed by zlib.
  bool active_only = false;  ///< Chunks may leave out inactive values.
};

/// Where a file has the values of a leaf, which has the voxels of a TensorBlock.
struct StoredLeaf {
  std::bitset<TensorBlock::voxels> active;
  std::int64_t at = 0;     ///< Position of the flag before its values.
  std::int32_t bytes = 0;  ///< From the flag on.
  std::int8_t flag = 0;
};

/// Reads through a tree whose topology begins at position `at`, and through the values that follow it. Only for files
/// of OpenVDB 3 (format 222) and later, and types that have a `value_size`.
/// @param leaves  Gets the leaves, in the file's order.
/// @return whether all lengths fit.
bool tree_fits(const FileBytes& file, std::int64_t at, const StoredTree& tree, std::vector<StoredLeaf>& leaves);

/// Whether the values of a leaf still have the lengths that tree_fits has found: the file may have changed.
/// @param bytes  Those of the leaf, from its flag on.
bool is_same(const StoredLeaf& leaf, const StoredTree& tree, const char* bytes);

/// Bytes of a value in memory, and in a file with 16-bit floats.
struct ValueSize {
  std::int64_t full, half;
};

/// Nothing for other types than float, double, vec3s and vec3d with nodes of 5, 4 and 3.
std::optional<ValueSize> value_size(const std::string& type);

}  // namespace tensorray
