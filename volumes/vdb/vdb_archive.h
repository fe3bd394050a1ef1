#pragma once
/// Reads and writes OpenVDB files, and reports damage and full disks. OpenVDB's own io::File does neither: it does
/// not check the state of its stream, so that it reads uncompressed files cut short as if they were whole, and it
/// trusts the lengths in damaged trees, which may end the process. vdb_tree_check.h checks the lengths first.
/// Not detected: changed bytes within voxel values or active masks where all lengths still fit, because the format
/// has no checksum. Files older than format 222 (OpenVDB 3) are refused: their lengths are not checked.
/// It includes all of OpenVDB: only sources that use OpenVDB themselves include it, and two headers of ../files.

#include <bitset>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <openvdb/openvdb.h>

#include "volumes/vdb/vdb_compression.h"
#include "volumes/vdb/vdb_tree_check.h"

namespace tensorray {

/// The types of grids that fields are made of.
using FieldGridTypes =
    openvdb::TypeList<openvdb::Vec3SGrid, openvdb::Vec3DGrid, openvdb::FloatGrid, openvdb::DoubleGrid>;

/// Where a file has the values of a tree's leaves.
struct StoredLeaves {
  std::optional<FileBytes> file;
  StoredTree tree;
  std::uint32_t compression = 0;   ///< OpenVDB's flags.
  std::vector<StoredLeaf> leaves;  ///< Leaf i is that of the tree whose transientData() is i.
};

/// A grid of a file.
struct VdbGrid {
  std::string name;                            ///< Unique in the file: the second of two grids "T" is "T[1]".
  std::string type;                            ///< Type of the tree: "Tree_vec3s_5_4_3".
  bool half = false;                           ///< The file stores 16-bit floats.
  openvdb::GridBase::Ptr grid;                 ///< Null unless the caller asked for it. Its leaves have no values.
  std::shared_ptr<const StoredLeaves> stored;  ///< The values.
};

struct VdbFile {
  openvdb::MetaMap metadata;
  std::vector<VdbGrid> grids;  ///< All grids, in the file's order.
};

/// Reads the table of grids. Also reads the grids whose names are in `wanted`; the values of leaves stay in the file.
/// @throw std::runtime_error, one line that names the file and the fix: missing, not a VDB, truncated, damaged.
VdbFile read_vdb(const std::filesystem::path& path, const std::set<std::string>& wanted = {});

/// An empty grid of a type that OpenVDB registers, made by the library: where a constructor is called, the compiler
/// makes all virtual functions of the grid and its tree once more, which takes seconds.
template <class Grid>
typename Grid::Ptr empty_grid() {
  openvdb::initialize();
  return openvdb::gridPtrCast<Grid>(openvdb::GridBase::createGrid(Grid::gridType()));
}

/// The active voxels of a leaf, in the order of a TensorBlock.
template <class Leaf>
std::bitset<TensorBlock::voxels> voxel_mask(const Leaf& leaf) {
  std::bitset<TensorBlock::voxels> active;
  if (leaf.isDense()) return active.set();
  for (openvdb::Index word = TensorBlock::voxels / 64; word-- > 0;)
    active = active << 64 | std::bitset<TensorBlock::voxels>(leaf.valueMask().template getWord<openvdb::Index64>(word));
  return active;
}

/// Reports damage in the voxels of a leaf. @throw std::runtime_error as read_vdb.
[[noreturn]] void fail_damaged_voxels(const std::filesystem::path& path);

/// A grid to be written.
struct WrittenGrid {
  openvdb::GridBase::Ptr grid;
  /// Writes the buffers of all leaves in their order in the tree, if they have no values in memory. Called once.
  std::function<void(std::ostream&)> write_values = {};
  openvdb::Index64 value_bytes = 0;  ///< What these values would take in memory.
};

/// Writes grids in place, and adds their statistics to their metadata. Equal grids give equal bytes: the file's unique
/// tag, which OpenVDB draws at random, is replaced by a hash of the contents.
/// @throw std::runtime_error naming the file and the reason, also when the disk is full.
void write_vdb(const std::filesystem::path& path, const std::vector<WrittenGrid>& grids,
               const openvdb::MetaMap& metadata, VdbCompression compression = VdbCompression::blosc);

// Where the voxels of a grid are. OpenVDB refuses transforms whose determinant is below 3e-15, such as voxels of ten
// micrometres in metres. Grids with smaller voxels are stored in a smaller unit of length, which their metadata have as
// `tensorray:length_unit`: one unit of the stored transform is so many units of world space.

/// Name of the unit in the metadata of a grid.
constexpr const char* length_unit_key = "tensorray:length_unit";

/// A power of ten, in units of world space.
struct LengthUnit {
  double value = 1;
  std::string text = "1";
};

/// The unit that voxels with this determinant are stored in; 1 if OpenVDB accepts them as they are.
LengthUnit length_unit_for(double determinant);

/// Notes the unit in the metadata of a grid whose transform is in it; 1 needs no note.
void note_unit(openvdb::GridBase& grid, const LengthUnit& unit);

/// Sets the transform of a grid, and the unit if it needs one. @param to_world  From voxel indices to world;
/// invertible.
void place(openvdb::GridBase& grid, const Eigen::Affine3d& to_world);

/// From voxel indices to world.
/// @throw std::runtime_error naming the file and the fix, if the transform is not affine, cannot be inverted, or is in
/// a unit that is not a positive number.
Eigen::Affine3d placement(const std::filesystem::path& path, const openvdb::GridBase& grid);

}  // namespace tensorray
