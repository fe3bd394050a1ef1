#pragma once
/// @file volumes/files/vdb_leaves.h
/// Reads the voxels of single leaves of an OpenVDB file, in any order and on any thread. OpenVDB itself reads a grid
/// from front to back, on one thread, and needs memory for all of it.

#include <array>
#include <cstdint>
#include <vector>

#include "volumes/files/file_bytes.h"
#include "volumes/files/tensor_entry.h"
#include "volumes/files/vdb_tree_check.h"

namespace tensorray {

/// Reads leaves of one grid. Each thread needs its own.
class LeafReader {
 public:
  /// Both must outlive it. @param tree  Of a type that tree_fits checks.
  LeafReader(const FileBytes& file, const StoredTree& tree);

  /// Whether the bytes of the leaf are in memory.
  bool has(const StoredLeaf& leaf) const {
    return leaf.at > first_ && leaf.at + leaf.bytes <= first_ + static_cast<std::int64_t>(stored_.size());
  }

  /// Brings the bytes of a leaf, and what follows them up to the end of another one, into memory.
  /// @throw Misfit if the file is damaged.
  void fetch(const StoredLeaf& leaf, const StoredLeaf& last);

  /// Unpacks the values of a leaf whose bytes are in memory. They stay until the next call.
  /// @throw Misfit, or what OpenVDB throws, if the file is damaged.
  void unpack(const StoredLeaf& leaf);

  /// Writes the values of the active voxels of `leaf`, the one unpacked last, to `block`.
  void put(const StoredLeaf& leaf, const std::vector<TensorEntry>& entries, TensorBlock& block) const;

  /// The values of `leaf`, the one unpacked last, if they are vectors of three floats and all its voxels are active.
  /// Four floats may be read at each. Otherwise null.
  const float* vectors(const StoredLeaf& leaf) const;

 private:
  void unpack(const char* chunk, std::size_t bytes, std::size_t expected);

  template <class Number>
  void put_numbers(const StoredLeaf& leaf, const std::vector<TensorEntry>& entries, TensorBlock& block) const;

  static constexpr std::size_t greatest_value = 24, blosc_overhead = 16;  // Bytes.

  const FileBytes& file_;
  const StoredTree& tree_;
  const ValueSize size_;
  std::vector<char> stored_;  ///< Bytes of the file from position `first_` on.
  std::int64_t first_ = 0;
  bool has_all_ = false;  ///< Values are those of all voxels, not of the active ones.
  alignas(8) std::array<char, TensorBlock::voxels * greatest_value + blosc_overhead> values_;
};

/// Writes the three rows of the tensors of all voxels, as `LeafReader::vectors` has them, to `block`.
void put_rows(const std::array<const float*, 3>& rows, TensorBlock& block);

}  // namespace tensorray
