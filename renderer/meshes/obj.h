#pragma once
/// @file renderer/meshes/obj.h
/// Reads meshes in Wavefront's format (.obj).

#include <filesystem>

#include "renderer/meshes/mesh_with_normals.h"

namespace tensorray {

/// Reads v, vn and f; all objects and groups are one mesh. Points, lines, texture coordinates and materials have no
/// surface and are left out. Anything else is an error, so that no face is lost. Positions are as in the file: not
/// joined, and not checked to be finite.
/// This reader exists because libraries make another mesh of what they do not understand, without a word: assimp 5.2
/// leaves out faces v/vt/vn of files without vt, and faces before a comment; tinyobjloader takes words that are no
/// numbers for 0, and leaves out continued lines and unknown statements.
/// @throw std::runtime_error with the line and the reason (not the file).
MeshWithNormals read_obj(const std::filesystem::path& path);

}  // namespace tensorray
