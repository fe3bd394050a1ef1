#pragma once
/// Intersects rays and points with triangles, by Embree.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "base/geometry/triangle_mesh.h"

namespace tensorray {

/// One of a scene's triangles.
struct TriangleId {
  std::uint32_t mesh = 0, triangle = 0;
};

/// Where a ray meets a triangle.
struct TriangleHit {
  double distance = 0;  ///< Along the unit direction, in single precision.
  std::uint32_t mesh = 0, triangle = 0;
  bool is_clear = false;  ///< Not at an edge or a vertex.
};

/// One of the triangles that a line meets.
struct TriangleCrossing {
  double distance = 0;  ///< As that of TriangleHit.
  std::uint32_t mesh = 0, triangle = 0;
  int sign = 0;           ///< 1: the line goes out, where normals point outwards; −1: in.
  bool is_clear = false;  ///< False at edges and vertices, where it may be counted twice.
};

/// A straight way.
struct Segment {
  Eigen::Vector3d from, to;
};

/// Immutable; any number of threads may query it at once. It keeps no reference to the meshes.
///
/// A query may have any values: if it cannot meet a triangle in single precision, or a value is NaN, it finds nothing.
/// A ray that starts far away is first moved to the triangles, in double precision.
class TriangleScene {
 public:
  /// In units from the origin. Triangles beyond this are never met: products of three coordinates would overflow.
  static constexpr double reach = 1e12;

  /// @param meshes        May include meshes without triangles; queries number the meshes in this order.
  /// @param origin, unit  Coordinates are converted to single precision relative to these, so that its resolution suits
  ///                      the scene, whatever the world's units.
  /// @throw std::runtime_error if Embree fails (out of memory, unsupported processor).
  TriangleScene(const std::vector<const TriangleMesh*>& meshes, const Eigen::Vector3d& origin, double unit);

  /// One mesh, in the plane z = 0. The build is faster, as such a mesh may have millions of triangles.
  TriangleScene(const std::vector<Eigen::Vector2d>& vertices,
                const std::vector<std::array<std::uint32_t, 3>>& triangles, const Eigen::Vector2d& origin, double unit);

  /// The nearest triangle between the two distances (world units; the first may be negative), from either side.
  std::optional<TriangleHit> nearest(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double min_distance,
                                     double max_distance) const;

  /// Bits of those of up to 16 segments, each longer by `margin` at both ends, that meet a triangle. It is fastest
  /// where they lie together. Near edges, within single precision, it may depend on the other segments. Those with a
  /// value that Embree cannot compute with are among them.
  /// @param outwards  Triangles that are clearly met from outside do not count.
  std::uint32_t met(const Segment* segments, int count, double margin, bool outwards) const;

  /// Sets `crossings` to all triangles between the two distances. Where none is in doubt, lines miss or meet a closed
  /// mesh consistently: the signs behind any point of the line add up to how often the mesh surrounds it.
  void crossings(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double min_distance,
                 double max_distance, std::vector<TriangleCrossing>& crossings) const;

  /// Sets `candidates` to the triangles that a ray meets, in order of mesh and triangle, in single precision.
  void along(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, std::vector<TriangleId>& candidates) const;

  /// Sets `candidates` to all triangles whose bounding boxes come within `radius` of the point, and some others, in
  /// order of mesh and triangle. 1e-6 units make up for single precision below one unit.
  void near(const Eigen::Vector3d& point, double radius, std::vector<TriangleId>& candidates) const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace tensorray
