#pragma once
/// @file renderer/surfaces/mesh_files.h
/// Writes triangle meshes with what their vertices carry; mesh.h reads them.

#include <filesystem>

#include "base/ply_writer.h"
#include "base/triangle_mesh.h"

namespace tensorray {

/// Writes a mesh as the ending of `path` says, in place, in pieces: memory does not grow with the mesh.
/// - `.ply`: as base/ply_writer.h.
/// - `.obj`: text; "v x y z" (with "r g b" from 0 to 1, which most programs read), "vn", "f a//a".
/// Positions are in single precision in both, in the fewest digits that keep it (seven to nine); colours and normals
/// are in .obj as exact as they can be seen: three and four decimals. Values are kept by .ply alone.
/// @throw std::invalid_argument on another ending, attributes of another number than the vertices, a vertex that is not
/// finite in single precision, a name of several words; std::runtime_error naming the file if it cannot be written
/// (also when the disk is full).
void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh, const VertexAttributes& attributes);

}  // namespace tensorray
