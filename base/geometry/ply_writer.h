#pragma once
/// @file base/geometry/ply_writer.h
/// Writes triangles as PLY files; renderer/meshes/mesh.h reads them.

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/geometry/triangle_mesh.h"

namespace tensorray {

/// What the vertices of a mesh carry besides their positions; null: nothing. One entry a vertex.
struct VertexAttributes {
  const std::vector<Eigen::Vector3f>* normals = nullptr;             ///< Unit.
  const std::vector<std::array<std::uint8_t, 3>>* colors = nullptr;  ///< RGB, as displayed (sRGB).
  const std::vector<float>* values = nullptr;
  std::string value_name = "value";  ///< One word.
};

enum class PlyPositions { single_precision, double_precision };

/// Writes a binary, little-endian file, in place, in pieces: x y z, nx ny nz, the value as float, red green blue as
/// uchar; then faces of three uint indices. The caller has checked that all sizes agree.
/// @throw std::runtime_error naming the file if it cannot be written (also when the disk is full).
void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh, PlyPositions precision,
               const VertexAttributes& attributes = {});

}  // namespace tensorray
