#pragma once
/// @file volumes/files/vdb_leaves.h
/// Reads the voxels of single leaves of an OpenVDB file, in any order and on any thread. OpenVDB itself reads a grid
/// from front to back, on one thread, and needs memory for all of it.

#include <vector>

#include "volumes/files/file_bytes.h"
#include "volumes/files/vdb_tree_check.h"

namespace tensorray {

/// The tensor entry that a component of a grid's value is stored in.
struct TensorEntry {
  int component, row, column;
};

/// Reads leaves of one grid. Each thread needs its own.
class LeafReader {
 public:
  /// Both must outlive it. @param tree  Of a type that tree_fits checks.
  LeafReader(const FileBytes& file, const StoredTree& tree);

  /// Writes the values of the leaf's active voxels to `block`.
  /// @throw Misfit, or what OpenVDB throws, if the file is damaged.
  void read(const StoredLeaf& leaf, const std::vector<TensorEntry>& entries, TensorBlock& block);

 private:
  template <class Number>
  void put(const char* values, const StoredLeaf& leaf, bool has_all, const std::vector<TensorEntry>& entries,
           TensorBlock& block) const;

  const FileBytes& file_;
  const StoredTree& tree_;
  const ValueSize size_;
  std::vector<char> stored_;
};

}  // namespace tensorray
