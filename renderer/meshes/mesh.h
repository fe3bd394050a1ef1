#pragma once
/// Triangle meshes and their files: .ply, .obj, .stl, .off, .gltf, .glb, .dae, .fbx. mesh_readers.h reads the formats.

#include <filesystem>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "base/geometry/triangle_mesh.h"

namespace tensorray {

/// Triangles, and what pictures take at their corners. A vertex is there once for each of its normals and places.
struct MeshWithNormals {
  TriangleMesh mesh;
  /// For each vertex, any length; zero: none is known. Empty: no vertex has one.
  std::vector<Eigen::Vector3f> normals;
  /// The place of each vertex in pictures on the mesh: (0, 0) is the lower left corner, (1, 1) the upper right one.
  /// Empty: the file has none. Not finite: the file says so, or names one that is not there.
  std::vector<Eigen::Vector2f> places;
};

/// Reads all meshes of a file as one mesh. Polygons are triangulated, vertices at equal positions are joined, unused
/// vertices and triangles of zero area are dropped. Positions have the file's precision in .ply, and single precision
/// in other formats. Formats with unit and axes (.gltf, .glb, .dae, .fbx) are in metres with +z up.
/// @param turn  A rotation of the formats that have no axes.
/// @throw std::runtime_error naming the file and the reason: missing, unreadable, no triangles, a vertex that is not
/// finite in single precision.
TriangleMesh read_mesh(const std::filesystem::path& path, const Eigen::Matrix3d& turn = Eigen::Matrix3d::Identity());

/// The same mesh for pictures. Places are those of .ply, .obj, .gltf, .glb, .dae and .fbx.
/// @param smooth_angle  Radians: normals are made so that edges look smooth where triangles are turned against each
/// other by at most this. None: the normals of the file, flat triangles where it has none.
MeshWithNormals read_mesh_with_normals(const std::filesystem::path& path, std::optional<double> smooth_angle,
                                       const Eigen::Matrix3d& turn = Eigen::Matrix3d::Identity());

/// At each corner of a triangle, the mean normal of the triangles that share the vertex and are turned against this one
/// by at most `angle` radians, weighted by their angles at the vertex (Thürmer and Wüthrich 1998), so that it does not
/// depend on how polygons were divided. The other edges stay sharp.
/// @param mesh  Vertices at equal positions are joined; no triangle has zero area.
MeshWithNormals with_smooth_normals(const TriangleMesh& mesh, double angle);

/// Writes a mesh in the format that the ending of `path` names. It writes in place and in pieces.
/// - `.ply`: as base/geometry/triangle_mesh.h.
/// - `.obj`: text; "v x y z" (with "r g b" from 0 to 1, which most programs read), "vn", "f a//a".
/// Both formats keep positions in single precision, with the fewest digits that reproduce them (seven to nine). In
/// .obj, colours have three decimals and normals four: the eye sees no finer difference. Only .ply keeps values.
/// @throw std::invalid_argument if the ending is another one, the number of attributes differs from the number of
/// vertices, a vertex is not finite in single precision, or a name has several words; std::runtime_error naming the
/// file if it cannot be written (also when the disk is full).
void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh, const VertexAttributes& attributes);

/// The parallelepiped that `transform` makes of the box: twelve triangles that face outwards.
TriangleMesh box_mesh(const Eigen::AlignedBox3d& box, const Eigen::Affine3d& transform);

/// Checks that the mesh is closed (open_edges). Reverses all triangles if they face inwards.
/// @throw std::invalid_argument with the number of open edges if the mesh is not closed, or if it encloses no volume.
void require_closed(TriangleMesh& mesh);

}  // namespace tensorray
