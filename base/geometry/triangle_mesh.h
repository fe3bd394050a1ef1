#pragma once
/// Triangles: the one type that fields, importers and the renderer share.

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "base/geometry/box.h"

namespace tensorray {

/// Triangles in world space; counter-clockwise from outside. An index names a vertex.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  Eigen::AlignedBox3d bounds() const { return box_of(vertices); }

  /// What a closed mesh encloses; positive if the triangles face outwards.
  double volume() const {
    const Eigen::Vector3d center = bounds().center();  // Coordinates relative to the centre avoid cancellation.
    double sum = 0;
    for (const auto& t : triangles) {
      const Eigen::Vector3d a = vertices[t[0]] - center, b = vertices[t[1]] - center;
      sum += a.dot(b.cross(vertices[t[2]] - center));
    }
    return sum / 6;
  }
};

/// The number of edges along which more triangles run one way than the other; each counts once a missing triangle.
std::size_t open_edges(const TriangleMesh& mesh);

// Writes triangles as PLY files; renderer/meshes/mesh.h reads them.

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
