#pragma once
/// Triangle meshes of tubes with elliptical cross sections.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "base/geometry/triangle_mesh.h"

namespace tensorray {

/// A point of a tube's axis with its ellipse center + x cos θ + y sin θ.
struct TubePoint {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  /// Conjugate semi-diameters (semi-axes are a special case), not parallel; x × y points to the tube's end.
  Eigen::Vector3d x = Eigen::Vector3d::Zero(), y = Eigen::Vector3d::Zero();
  double value = 0;  ///< Interpolated along the tube, for example for a colour.
  double shade = 0;  ///< Adds rings where it is not linear along the tube, as `value` does. The mesh does not store it.
};

/// Two points or more; a tube with fewer makes no triangles.
using Tube = std::vector<TubePoint>;

enum class TubeStyle {
  solid,  ///< The surface that the ellipses sweep.
  wire,   ///< Thin round wires along ellipses, and along lines that join them.
  discs,  ///< Separate ellipses, as thin flat discs.
};

enum class TubeCaps {
  open,   ///< No caps.
  flat,   ///< The end's ellipse, with a sharp edge.
  round,  ///< Half an ellipsoid, as high as the ellipse's lesser semi-axis; the surface is smooth.
};

/// Lengths are in world units; 0 means a multiple of `typical_radius`, as noted.
struct TubeSettings {
  TubeStyle style = TubeStyle::solid;
  TubeCaps caps = TubeCaps::flat;  ///< Caps of solid tubes, and of the wires that run along tubes.

  /// Greatest distance between the triangles and the smooth tube. With curvature and the change of the ellipses it sets
  /// the number of rings; with the size of the ellipses, the number of segments around them. 0: 1/50.
  double tolerance = 0;
  int min_segments = 6;   ///< Fewest segments around an ellipse; >= 3.
  int max_segments = 64;  ///< Most segments around an ellipse; >= min_segments.

  double spacing = 0;      ///< Distance along the tube between the ellipses of the wire and disc styles. 0: 2.
  double wire_radius = 0;  ///< Radius of the wires. 0: 1/20.
  int lines = 8;           ///< Wire style: number of wires along the tube; >= 0.
  double thickness = 0;    ///< Thickness of discs. 0: 1/10.

  /// Limits the memory: a triangle of a solid tube takes about 34 bytes here, and about 70 more in a ray tracer.
  std::uint64_t max_triangles = 250'000'000;  ///< At most 2^31.
};

/// Triangles, counter-clockwise from outside, with what shading needs at each vertex. The triangles of a smooth surface
/// share vertices; the sharp edge of a flat cap has two vertices at each position.
struct TubeMesh {
  TriangleMesh mesh;
  std::vector<Eigen::Vector3f> normals;  ///< Unit, outwards; one for each vertex, as `values`.
  std::vector<float> values;
  std::vector<std::uint32_t> tube_ends;  ///< For each tube: the number of triangles in it and all tubes before.
};

/// The median of |x| over all points: the typical size of the tubes. 0 if there are no points.
double typical_radius(const std::vector<Tube>& tubes);

/// Runs on all threads; the result does not depend on their number. The function frees each tube after its mesh is
/// made: move `tubes` in to save memory. A solid tube has at most 64 rings for each of its points; the other styles
/// have an ellipse at every `spacing`. If a tube bends more tightly than it is thick, its surface intersects itself.
/// @throw std::invalid_argument if a setting or a point is out of range; std::runtime_error if there are more triangles
/// than the settings allow (thrown before all are made, so memory stays near the limit).
TubeMesh make_tube_mesh(std::vector<Tube> tubes, const TubeSettings& settings);

}  // namespace tensorray
