#pragma once
/// @file renderer/surfaces/ply.h
/// Meshes in the Stanford polygon format (.ply), ASCII and binary.

#include <filesystem>

#include "base/triangle_mesh.h"

namespace tensorray {

/// Reads the elements `vertex` (x, y, z) and `face` (vertex_indices) and passes over all others. Polygons become fans,
/// as is right for convex ones. Vertices are as in the file: not joined, and finite or not.
/// It is here because assimp 5.2 does not read the format reliably: it repeats the last face of a file that was cut
/// off, never returns from a cut header, and misreads binary vertices that begin with a line end's byte.
/// @throw std::runtime_error with the reason (not the file): not PLY, cut off, a face names a vertex that is not there.
TriangleMesh read_ply(const std::filesystem::path& path);

}  // namespace tensorray
