#pragma once
/// @file volumes/files/vdb_archive.h
/// Reads and writes OpenVDB files such that no damage and no full disk goes unnoticed. OpenVDB's own io::File does not
/// check the state of its stream, so that uncompressed files cut short are read as if whole, and takes lengths in
/// damaged trees as they are, which may end the process: vdb_tree_check.h looks at them before. What remains: bytes
/// changed within the voxels, or within the masks of which are active, are not noticed where the lengths still fit, as
/// the format has no checksum; and the lengths are not looked at in files older than format 222 (OpenVDB 3), and in
/// trees of other types than this program reads, where a file without table of grids has such. Only .cpp files of this
/// folder that use OpenVDB themselves include this header: it brings all of OpenVDB.

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <openvdb/openvdb.h>

namespace tensorray {

/// A grid of a file.
struct VdbGrid {
  std::string name;             ///< Made unique: the second of two grids "T" is "T[1]".
  std::string type;             ///< Of its tree: "Tree_vec3s_5_4_3".
  bool half = false;            ///< The file stores 16-bit floats.
  openvdb::GridBase::Ptr grid;  ///< Null unless it was asked for.
};

struct VdbFile {
  openvdb::MetaMap metadata;
  std::vector<VdbGrid> grids;  ///< All, in the file's order.
};

/// Reads the table of grids and, completely, the grids whose name is in `wanted`.
/// @throw std::runtime_error, one line that names the file and the mend: missing, not a VDB, truncated, damaged.
VdbFile read_vdb(const std::filesystem::path& path, const std::set<std::string>& wanted = {});

/// Writes grids with OpenVDB's default compression, in place. The same grids give the same bytes: the file's unique
/// tag, which OpenVDB draws at random, is made of the contents.
/// @throw std::runtime_error naming the file and the reason, also when the disk is full.
void write_vdb(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& metadata);

/// A grid's transform from what takes its indices to the world.
openvdb::math::Transform::Ptr linear_transform(const Eigen::Affine3d& to_world);

}  // namespace tensorray
