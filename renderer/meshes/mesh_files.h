#pragma once
/// @file renderer/meshes/mesh_files.h
/// Writes triangle meshes with the attributes of their vertices; mesh.h reads meshes.

#include <filesystem>

#include "base/geometry/ply_writer.h"
#include "base/geometry/triangle_mesh.h"

namespace tensorray {

/// Writes a mesh in the format that the ending of `path` names. It writes in place and in pieces, so memory does not
/// grow with the mesh.
/// - `.ply`: as base/geometry/ply_writer.h.
/// - `.obj`: text; "v x y z" (with "r g b" from 0 to 1, which most programs read), "vn", "f a//a".
/// Both formats keep positions in single precision, with the fewest digits that reproduce them (seven to nine). In
/// .obj, colours have three decimals and normals four: the eye sees no finer difference. Only .ply keeps values.
/// @throw std::invalid_argument if the ending is another one, the number of attributes differs from the number of
/// vertices, a vertex is not finite in single precision, or a name has several words; std::runtime_error naming the
/// file if it cannot be written (also when the disk is full).
void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh, const VertexAttributes& attributes);

}  // namespace tensorray
