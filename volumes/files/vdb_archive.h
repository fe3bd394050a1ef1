#pragma once
/// @file volumes/files/vdb_archive.h
/// Reads and writes OpenVDB files, and reports damage and full disks. OpenVDB's own io::File does neither: it does
/// not check the state of its stream, so that it reads uncompressed files cut short as if they were whole, and it
/// trusts the lengths in damaged trees, which may end the process. vdb_tree_check.h checks the lengths first.
/// Not detected: changed bytes within voxel values or active masks where all lengths still fit, because the format
/// has no checksum. Not checked: lengths in files older than format 222 (OpenVDB 3), and, in files without a table of
/// grids, lengths in trees of types that this program does not read.
/// Only .cpp files of this folder that use OpenVDB themselves include this header: it includes all of OpenVDB.

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <openvdb/openvdb.h>

#include "volumes/files/vdb_tree_check.h"

namespace tensorray {

/// A grid of a file.
struct VdbGrid {
  std::string name;             ///< Unique in the file: the second of two grids "T" is "T[1]".
  std::string type;             ///< Type of the tree: "Tree_vec3s_5_4_3".
  bool half = false;            ///< The file stores 16-bit floats.
  openvdb::GridBase::Ptr grid;  ///< Null unless the caller asked for it.
};

struct VdbFile {
  openvdb::MetaMap metadata;
  std::vector<VdbGrid> grids;  ///< All grids, in the file's order.
};

/// Reads the table of grids. Also reads the grids whose names are in `wanted`, with their voxels.
/// @param box  Only the voxels in this box, whose faces are those of leaves; null: all. Others do not come into memory.
/// @throw std::runtime_error, one line that names the file and the fix: missing, not a VDB, truncated, damaged.
VdbFile read_vdb(const std::filesystem::path& path, const std::set<std::string>& wanted = {},
                 const openvdb::CoordBBox* box = nullptr);

/// A grid of a file, without its voxels.
struct VdbLeafGrid {
  openvdb::GridBase::Ptr grid;
  StoredTree tree;
  std::vector<StoredLeaf> leaves;
};

/// The file as read_vdb gives it without grids, and where the voxels of the wanted grids are, by the grids' names.
struct VdbLeafFile {
  VdbFile file;
  std::map<std::string, VdbLeafGrid> grids;
};

/// Reads where the voxels of the wanted grids are.
/// @return nothing if they cannot be read leaf by leaf: some are in tiles, in a tree that another grid shares or of
/// another type than tree_fits knows, or the file is of OpenVDB 2 or has no table of grids. @throw as read_vdb.
std::optional<VdbLeafFile> read_vdb_leaves(const std::filesystem::path& path, const std::set<std::string>& wanted);

/// Reports damage in the voxels of a leaf. @throw std::runtime_error as read_vdb.
[[noreturn]] void fail_damaged_voxels(const std::filesystem::path& path);

/// Writes grids in place with OpenVDB's default compression, and adds their statistics to their metadata; writeBuffers
/// is called once for each, and is the only one of their functions that needs voxels' values. Equal grids give equal
/// bytes: the file's unique tag, which OpenVDB draws at random, is replaced by a hash of the contents.
/// @throw std::runtime_error naming the file and the reason, also when the disk is full.
void write_vdb(const std::filesystem::path& path, const openvdb::GridPtrVec& grids, const openvdb::MetaMap& metadata);

}  // namespace tensorray
