#pragma once
/// @file renderer/surfaces/planar_mesh.h
/// A mesh in a plane that may fold over itself: which of its triangles cover a point?

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "renderer/surfaces/triangle_scene.h"

namespace tensorray {

struct PlanarMesh {
  std::vector<Eigen::Vector2d> vertices;                ///< Finite where a triangle uses them.
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< Of either orientation; degenerate ones are never found.
};

struct PlanarHit {
  std::uint32_t triangle = 0;
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();  ///< Barycentric, in double precision; none < 0, sum 1.
};

/// Immutable; any number of threads may query it at once. The mesh must outlive it.
class PlanarMeshSearch {
 public:
  /// @throw std::runtime_error if Embree fails.
  explicit PlanarMeshSearch(const PlanarMesh& mesh);

  /// All triangles that cover `point`, in their order. A point on an edge, up to the rounding of double precision at
  /// the mesh's largest coordinate, is found in all triangles that share it, and never falls between them.
  void find(const Eigen::Vector2d& point, std::vector<PlanarHit>& hits) const;

 private:
  const PlanarMesh* mesh_;
  Eigen::AlignedBox2d box_;
  double size_;       // Of the box; 1 where it has none.
  double tolerance_;  // How far outside a triangle a point may be and still count as on its edge.
  TriangleScene scene_;
};

}  // namespace tensorray
