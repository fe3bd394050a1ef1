#pragma once
/// @file volumes/files/vdb_tree_check.h
/// Checks that the lengths in a stored OpenVDB tree fit the tree and the file. OpenVDB does not check them: it
/// allocates memory for the values that a chunk should have, and then writes as many bytes as the chunk claims to
/// have.

#include <cstdint>
#include <istream>
#include <string>

namespace tensorray {

/// How a file stores a tree.
struct StoredTree {
  std::string type;            ///< "Tree_vec3s_5_4_3".
  bool half = false;           ///< Values of voxels are 16-bit floats.
  bool blosc = false;          ///< Chunks of values are compressed by Blosc.
  bool zip = false;            ///< If `blosc` is false: chunks of values are compressed by zlib.
  bool active_only = false;    ///< Chunks may leave out inactive values.
  std::int64_t file_size = 0;  ///< Bytes.
};

/// Reads through a tree whose topology begins at the position of `in`, and through the values that follow it.
/// Afterwards `in` is at their end. Only for files of OpenVDB 3 (format 222) and later. It accepts without a check
/// trees of other types than float, double, vec3s and vec3d with nodes of 5, 4 and 3.
/// @return whether all lengths fit. @throw whatever `in` throws at its end, if its exceptions are enabled.
bool tree_fits(std::istream& in, const StoredTree& tree);

/// Whether the lengths in the value of a grid's metadata "file_delayed_load" fit. OpenVDB unpacks this value when it
/// reads the metadata.
bool delayed_load_fits(const std::string& value, std::int64_t file_size);

/// Whether a Blosc chunk that begins with `header` (16 bytes) has a length of `stored` bytes, and unpacks to
/// `expected` bytes.
bool blosc_fits(const char* header, std::int64_t stored, std::int64_t expected);

}  // namespace tensorray
