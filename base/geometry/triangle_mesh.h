#pragma once
/// @file base/geometry/triangle_mesh.h
/// Triangles: the one type that fields, importers and the renderer share.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

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

}  // namespace tensorray
