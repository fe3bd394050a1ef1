#pragma once
/// @file renderer/meshes/mesh.h
/// Triangle meshes and their files: .ply, .obj, .stl, .off, .gltf, .glb, .dae, .fbx.

#include <filesystem>
#include <optional>

#include <Eigen/Geometry>

#include "base/geometry/triangle_mesh.h"
#include "renderer/meshes/mesh_with_normals.h"

namespace tensorray {

/// Reads all meshes of a file as one mesh. Polygons are triangulated, vertices at equal positions are joined, unused
/// vertices and triangles of zero area are dropped. Positions have the file's precision in .ply, and single precision
/// in other formats. Formats that say their unit and axes (.gltf, .glb, .dae, .fbx) are read in metres with +z up; the
/// numbers of the others are taken as they are.
/// @throw std::runtime_error naming the file and the reason: missing, unreadable, no triangles, a vertex that is not
/// finite in single precision.
TriangleMesh read_mesh(const std::filesystem::path& path);

/// The same mesh for pictures: a vertex is there once for each of its normals.
/// @param smooth_angle  Radians: normals are made so that edges look smooth where triangles are turned against each
/// other by at most this. None: the normals of the file, flat triangles where it has none.
MeshWithNormals read_mesh_with_normals(const std::filesystem::path& path, std::optional<double> smooth_angle);

/// The parallelepiped that `transform` makes of the box: twelve triangles that face outwards.
TriangleMesh box_mesh(const Eigen::AlignedBox3d& box, const Eigen::Affine3d& transform);

/// Checks that the mesh is closed (along every edge, as many triangles run one way as the other). Reverses all
/// triangles if they face inwards.
/// @throw std::invalid_argument with the number of open edges if the mesh is not closed, or if it encloses no volume.
void require_closed(TriangleMesh& mesh);

}  // namespace tensorray
