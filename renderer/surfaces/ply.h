#pragma once
/// @file renderer/surfaces/ply.h
/// Reads meshes in the Stanford polygon format (.ply), ASCII and binary.

#include <filesystem>

#include "base/triangle_mesh.h"

namespace tensorray {

/// Reads the elements `vertex` (x, y, z) and `face` (vertex_indices) and skips all others. Polygons become fans, which
/// is correct for convex polygons. Vertices are as in the file: not joined, and not checked to be finite.
/// This reader exists because assimp 5.2 does not read the format reliably: it repeats the last face of a truncated
/// file, never returns from a truncated header, and misreads binary vertices that begin with the byte of a line end.
/// @throw std::runtime_error with the reason (not the file): not PLY, cut off, a face names a vertex that is not there.
TriangleMesh read_ply(const std::filesystem::path& path);

}  // namespace tensorray
