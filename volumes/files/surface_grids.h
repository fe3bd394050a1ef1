#pragma once
/// The surface of a body, as two grids of a field's file: NAME_surface_points, in index space of the field, so that who
/// moves the field moves it, too, and NAME_surface_triangles, the numbers of their points. They are Vec3 grids of
/// single precision, which all programs read. Their voxels, block by block, z fastest, are a list: two of them are a
/// row of three numbers, the first one rounded, the second one what rounding has lost. Only .cpp files of this folder
/// include this header: it includes all of OpenVDB.

#include <filesystem>
#include <set>
#include <string>

#include "volumes/grids/tensor_grid.h"
#include "volumes/vdb/vdb_archive.h"

namespace tensorray {

/// The names of the two grids.
std::set<std::string> surface_names(const std::string& field);

/// @param to_world  Of the field. @param first_voxel  The grids lie at it, for programs that draw all grids.
/// @return no grid if there is no surface.
openvdb::GridPtrVec surface_grids(const TriangleMesh& surface, const std::string& field,
                                  const Eigen::Affine3d& to_world, const Eigen::Vector3i& first_voxel);

/// @param file  Read with the two grids, if it has them. @return no triangles if it has neither.
/// @throw std::runtime_error naming the file: one is missing, they are damaged.
TriangleMesh read_surface(const std::filesystem::path& path, const VdbFile& file, const std::string& field,
                          const Eigen::Affine3d& to_world);

}  // namespace tensorray
