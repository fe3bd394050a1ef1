#pragma once
/// @file renderer/meshes/assimp_mesh.h
/// Meshes that assimp reads: .stl, .off, .gltf, .glb, .dae, .fbx. Damaged files of these formats can crash the process
/// that reads them, so another one does: `tensorray --read-mesh`. The two exchange triangles in a file without a name.

#include <filesystem>

#include "renderer/meshes/mesh_with_normals.h"

namespace tensorray {

/// All meshes of a file, in metres with +z up where the format says its unit and axes. Any thread may call this. Where
/// there is no program `tensorray` (child_program.h), as beside another program that uses the library, the file is read
/// in this process, where .off files with faces of vertices that are not there are read with other ones.
/// @throw std::runtime_error with the reason, without the file: not of its format, cut off, damaged, names a vertex or
/// a mesh that is not there, ended its reader, does not fit in memory; Cancelled.
MeshWithNormals read_assimp_mesh(const std::filesystem::path& path);

/// What `tensorray --read-mesh` does: reads the file in this process, and writes the mesh to `exchange`, in place and
/// in the machine's byte order. @throw std::runtime_error as above.
void write_assimp_mesh(const std::filesystem::path& path, const std::filesystem::path& exchange);

}  // namespace tensorray
