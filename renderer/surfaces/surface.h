#pragma once
/// @file renderer/surfaces/surface.h
/// What a picture of surfaces is made of: plain data.

#include <cstdint>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "base/triangle_mesh.h"

namespace tensorray {

/// Strands of round cones: spheres whose centre and radius go linearly from point to point, with round ends. They are
/// shaded as if their axes were smooth. For opaque materials.
struct RoundCurves {
  std::vector<Eigen::Vector3d> points;     ///< World.
  std::vector<float> radii;                ///< One a point; world units, >= 0.
  std::vector<std::uint32_t> strand_ends;  ///< For each strand in order, how many points it and those before it have.
};

/// A surface with all that shading and the auxiliary planes of a picture need. Vectors "a point" have a value for each
/// vertex of a mesh or point of curves, linear between them; or they are empty.
///
/// Memory: 140 bytes a triangle, measured on tubes of 5 million triangles with normals and colours, the building of
/// SurfaceScene included.
struct ShadedSurface {
  std::variant<TriangleMesh, RoundCurves> shape;
  std::vector<Eigen::Vector3f> normals;  ///< A point, of meshes only; any length. Empty: flat triangles.
  int material = 0;                      ///< Index.
  int light = -1;                        ///< Index of the AreaLight with this mesh, if it shines.

  std::vector<Eigen::Vector3f> colors;   ///< A point; of the working space, 0 to 1. Empty: the material's reflectance.
  std::vector<float> forces;             ///< A point.
  std::vector<float> arc_lengths;        ///< A point.
  std::vector<std::uint32_t> path_ends;  ///< For each path, how many triangles it and those before it have, as in
                                         ///< TubeMesh. Empty: no paths.
  bool strands_are_paths = false;        ///< Of curves: each strand is a path.
  std::uint32_t first_path = 0;          ///< The number of the first path; the others follow.
};

}  // namespace tensorray
