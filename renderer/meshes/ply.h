#pragma once
/// @file renderer/meshes/ply.h
/// Reads meshes in the Stanford polygon format (.ply), ASCII and binary.

#include <filesystem>

#include "renderer/meshes/mesh_with_normals.h"

namespace tensorray {

/// Reads the elements `vertex` (x, y, z and nx, ny, nz), `face` and `tristrips` (vertex_indices, where −1 begins a new
/// strip), and skips all others. Vertices are as in the file: not joined, and not checked to be finite.
/// This reader exists because assimp 5.2 does not read the format reliably: it repeats the last face of a truncated
/// file, never returns from a truncated header, and misreads binary vertices that begin with the byte of a line end.
/// @throw std::runtime_error with the reason (not the file): not PLY, cut off, a face names a vertex that is not there,
/// or has fewer than three corners.
MeshWithNormals read_ply(const std::filesystem::path& path);

}  // namespace tensorray
