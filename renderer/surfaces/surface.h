#pragma once
/// The surfaces that a picture shows, as plain data.

#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "base/geometry/triangle_mesh.h"
#include "renderer/surfaces/plate.h"

namespace tensorray {

/// A picture as the colours of a flat surface.
struct SurfaceTexture {
  Plate plate;  ///< Where the picture lies; its pixels are those of `colors`. Beyond its edges their colours go on.
  std::vector<Eigen::Vector3f> colors;  ///< Row by row from the top; working space, 0 to 1.
  bool smooth = true;                   ///< Linear interpolation between the middles of pixels; false: sharp pixels.
};

/// Pictures on a mesh, each with rows from the top, or empty. They repeat beyond their edges.
struct MeshPictures {
  struct Picture {
    int width = 0, height = 0;
    std::vector<Eigen::Vector3f> pixels;
  };
  Picture color;      ///< Working space, 0 to 1.
  Picture roughness;  ///< The second value chooses one of `roughness_steps` materials: 0 the first, 1 the last.
  Picture normal;     ///< 2 x − 1 is a normal along the tangents of u and v, and the shading normal (OpenGL's).
  int roughness_steps = 1;
};

/// Strands of round cones: the centre and the radius change linearly from point to point, and the ends are round.
/// Shading treats their axes as smooth. For opaque materials.
struct RoundCurves {
  std::vector<Eigen::Vector3d> points;     ///< World.
  std::vector<float> radii;                ///< One for each point; world units, >= 0.
  std::vector<std::uint32_t> strand_ends;  ///< For each strand: the number of points in it and all strands before.
};

/// A surface with everything that shading and the auxiliary planes of a picture need. Vectors marked "for each point"
/// have one value for each vertex of a mesh or point of curves, linear between them, or none.
///
/// Memory: 140 bytes for each triangle, with the build of SurfaceScene (5 million triangles).
struct ShadedSurface {
  std::variant<TriangleMesh, RoundCurves> shape;
  std::vector<Eigen::Vector3f> normals;  ///< For each point, meshes only; any length. Empty: flat triangles.
  int material = 0;                      ///< Index of the material, or of the first one of a picture of roughness.
  float opacity = 1;                     ///< Meshes only: the part of the rays that meet it; others pass.
  int light = -1;                        ///< Index of the AreaLight with this mesh, if the surface emits light.

  std::vector<Eigen::Vector3f> colors;  ///< For each point; working space, 0 to 1. Empty: the material's reflectance.
  std::shared_ptr<const SurfaceTexture> texture;  ///< Colours of a flat surface, instead of `colors`; or null.
  std::vector<Eigen::Vector2f> places;            ///< For each point, meshes only: u and v of `pictures`; else unused.
  std::shared_ptr<const MeshPictures> pictures;   ///< Of a mesh with places; or null.
  std::vector<float> forces;                      ///< For each point.
  std::vector<float> arc_lengths;                 ///< For each point.
  std::vector<std::uint32_t> path_ends;  ///< Triangles up to the end of each path, as in TubeMesh. Empty: no paths.
  bool strands_are_paths = false;        ///< Curves only: each strand is a path.
  std::uint32_t first_path = 0;          ///< Number of the first path; the others follow.
};

}  // namespace tensorray
