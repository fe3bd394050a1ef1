#pragma once
/// @file volumes/files/vdb_tree_check.h
/// Whether the lengths within a stored OpenVDB tree fit the tree and the file. OpenVDB takes them as they are: it
/// writes as many bytes as a chunk of values says it has into memory that was made for those that it should have.

#include <cstdint>
#include <istream>
#include <string>

namespace tensorray {

/// How a file stores a tree.
struct StoredTree {
  std::string type;            ///< "Tree_vec3s_5_4_3".
  bool half = false;           ///< Values of voxels are 16-bit floats.
  bool blosc = false;          ///< Chunks of values are compressed by Blosc ...
  bool zip = false;            ///< ... or else by zlib.
  bool active_only = false;    ///< Chunks may leave out inactive values.
  std::int64_t file_size = 0;  ///< Bytes.
};

/// Walks a tree whose topology begins where `in` stands, and its values, which follow; `in` stands behind them then.
/// Files of OpenVDB 3 (format 222) and later; passes over trees of other types than those of float, double, vec3s and
/// vec3d with nodes of 5, 4 and 3.
/// @return whether all lengths fit. @throw what `in` throws at its end, if it is set to.
bool tree_fits(std::istream& in, const StoredTree& tree);

/// Whether the value of a grid's metadata "file_delayed_load" has lengths that fit, which OpenVDB unpacks with the
/// rest.
bool delayed_load_fits(const std::string& value, std::int64_t file_size);

/// Whether a chunk of Blosc of `stored` bytes, which begins with `header` (16 bytes), is of that length, and has
/// `expected` bytes when it is unpacked.
bool blosc_fits(const char* header, std::int64_t stored, std::int64_t expected);

}  // namespace tensorray
