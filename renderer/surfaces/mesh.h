#pragma once
/// @file renderer/surfaces/mesh.h
/// Triangle meshes and their files (.ply, .obj and the other formats that assimp reads).

#include <filesystem>

#include <Eigen/Geometry>

#include "base/triangle_mesh.h"

namespace tensorray {

/// Reads all meshes of a file as one mesh. Polygons are triangulated, vertices at equal positions are joined, unused
/// vertices and triangles of zero area are dropped. Positions have the file's precision in .ply, and single precision
/// in other formats.
/// @throw std::runtime_error naming the file and the reason: missing, unreadable, no triangles, a vertex that is not
/// finite in single precision.
TriangleMesh read_mesh(const std::filesystem::path& path);

/// The parallelepiped that `transform` makes of the box: twelve triangles that face outwards.
TriangleMesh box_mesh(const Eigen::AlignedBox3d& box, const Eigen::Affine3d& transform);

/// Checks that the mesh is closed (along every edge, as many triangles run one way as the other). Reverses all
/// triangles if they face inwards.
/// @throw std::invalid_argument with the number of open edges if the mesh is not closed, or if it encloses no volume.
void require_closed(TriangleMesh& mesh);

}  // namespace tensorray
