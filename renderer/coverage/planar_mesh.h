#pragma once
/// Finds the triangles that cover a point, in a planar mesh that may fold over itself.

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "renderer/surfaces/triangle_scene.h"

namespace tensorray {

struct PlanarMesh {
  std::vector<Eigen::Vector2d> vertices;                ///< Must be finite if a triangle uses them.
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< In either orientation; degenerate ones are never found.
};

struct PlanarHit {
  std::uint32_t triangle = 0;
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();  ///< Barycentric, in double precision; each >= 0, sum 1.
};

/// Immutable; any number of threads may query it at once. The mesh must outlive it.
class PlanarMeshSearch {
 public:
  /// @throw std::runtime_error if Embree fails.
  explicit PlanarMeshSearch(const PlanarMesh& mesh);

  /// Sets `hits` to all triangles that cover `point`, in order of their indices. A point on an edge, up to the rounding
  /// of double precision at the mesh's largest coordinate, is found in all triangles that share it.
  void find(const Eigen::Vector2d& point, std::vector<PlanarHit>& hits) const;

 private:
  const PlanarMesh* mesh_;
  Eigen::AlignedBox2d box_;
  double size_;       // Size of the box; 1 if it has none.
  double tolerance_;  // A point this far outside a triangle still counts as on its edge.
  TriangleScene scene_;
};

}  // namespace tensorray
