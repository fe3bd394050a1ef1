#pragma once
/// @file renderer/surfaces/mesh.h
/// Triangle meshes and their files (.ply, .obj and what else assimp reads).

#include <filesystem>

#include <Eigen/Geometry>

#include "base/triangle_mesh.h"

namespace tensorray {

/// Reads all meshes of a file as one, polygons triangulated, vertices at equal positions joined (and unused ones
/// dropped), triangles of zero area dropped. Positions have the file's precision in .ply, and single precision else.
/// @throw std::runtime_error naming the file and the reason: missing, unreadable, no triangles, a vertex that is not
/// finite in single precision.
TriangleMesh read_mesh(const std::filesystem::path& path);

/// The parallelepiped that `transform` makes of the box: twelve triangles that look outwards.
TriangleMesh box_mesh(const Eigen::AlignedBox3d& box, const Eigen::Affine3d& transform);

/// Checks that the mesh is closed (along every edge as many triangles run one way as the other) and turns all triangles
/// round if they look inwards.
/// @throw std::invalid_argument with the number of open edges if it is not closed, or if it encloses no volume.
void require_closed(TriangleMesh& mesh);

}  // namespace tensorray
