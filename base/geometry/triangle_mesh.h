#pragma once
/// @file base/geometry/triangle_mesh.h
/// Triangles: the one type that fields, importers and the renderer share.

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "base/geometry/box.h"

namespace tensorray {

/// Triangles in world space; counter-clockwise from outside. An index names a vertex.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  Eigen::AlignedBox3d bounds() const { return box_of(vertices); }
};

}  // namespace tensorray
