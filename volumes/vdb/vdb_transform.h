#pragma once
/// @file volumes/vdb/vdb_transform.h
/// Where the voxels of an OpenVDB grid are. OpenVDB refuses transforms whose determinant is below 3e-15, such as voxels
/// of ten micrometres in metres. Grids with smaller voxels are stored in a smaller unit of length, which their metadata
/// have as `tensorray:length_unit`: one unit of the stored transform is so many units of world space.
/// Only .cpp files of this folder that use OpenVDB themselves include this header.

#include <filesystem>
#include <string>

#include <Eigen/Geometry>
#include <openvdb/openvdb.h>

namespace tensorray {

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
