#pragma once
/// @file renderer/surfaces/mesh_files.h
/// Writes triangle meshes with what their vertices carry; mesh.h reads them.

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "renderer/surfaces/mesh.h"

namespace tensorray {

/// What the vertices of a mesh carry besides their positions; null: nothing. One entry a vertex.
struct VertexAttributes {
  const std::vector<Eigen::Vector3f>* normals = nullptr;             ///< Unit.
  const std::vector<std::array<std::uint8_t, 3>>* colors = nullptr;  ///< RGB, as displayed (sRGB).
  const std::vector<float>* values = nullptr;                        ///< Kept by .ply alone.
  std::string value_name = "value";                                  ///< In .ply; one word.
};

/// Writes a mesh as the ending of `path` says, in place, in pieces: memory does not grow with the mesh.
/// - `.ply`: binary, little-endian; x y z, nx ny nz, the value as float, red green blue as uchar; faces.
/// - `.obj`: text; "v x y z" (with "r g b" from 0 to 1, which most programs read), "vn", "f a//a".
/// Positions are in single precision in both, in the fewest digits that keep it (seven to nine); colours and normals
/// are in .obj as exact as they can be seen: three and four decimals.
/// @throw std::invalid_argument on another ending, attributes of another number than the vertices, a vertex that is not
/// finite in single precision, a name of several words; std::runtime_error naming the file if it cannot be written
/// (also when the disk is full).
void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh, const VertexAttributes& attributes);

}  // namespace tensorray
