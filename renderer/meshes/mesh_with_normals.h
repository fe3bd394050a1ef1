#pragma once
/// @file renderer/meshes/mesh_with_normals.h
/// Triangles and the normals that shading takes at their corners.

#include <vector>

#include <Eigen/Core>

#include "base/geometry/triangle_mesh.h"

namespace tensorray {

/// A vertex where several normals meet is there several times, once for each.
struct MeshWithNormals {
  TriangleMesh mesh;
  std::vector<Eigen::Vector3f>
      normals;  ///< For each vertex, any length; zero: none is known. Empty: no vertex has one.
};

}  // namespace tensorray
