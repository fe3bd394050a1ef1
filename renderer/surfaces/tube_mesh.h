#pragma once
/// @file renderer/surfaces/tube_mesh.h
/// Triangles of tubes with elliptical cross sections.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "base/triangle_mesh.h"

namespace tensorray {

/// A point of a tube's axis with its ellipse, center + x cos θ + y sin θ.
struct TubePoint {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  /// Conjugate semi-diameters (semi-axes are such), not parallel; x × y points along the tube, towards its end. Points
  /// of equal θ are joined.
  Eigen::Vector3d x = Eigen::Vector3d::Zero(), y = Eigen::Vector3d::Zero();
  double value = 0;  ///< Interpolated; a colour is made of it, say.
  double shade = 0;  ///< Where it is not linear along the tube there are rings for it, as for the value; not kept.
};

/// Two points or more; an empty one, or of a single point, makes no triangles.
using Tube = std::vector<TubePoint>;

enum class TubeStyle {
  solid,  ///< The surface that the ellipses sweep.
  wire,   ///< Thin round wires along ellipses, and along lines that join them.
  discs,  ///< Separate ellipses, as thin flat discs.
};

enum class TubeCaps {
  open,   ///< None.
  flat,   ///< The end's ellipse, with a sharp edge.
  round,  ///< Half an ellipsoid, as high as its ellipse is thin; the surface is smooth.
};

/// Lengths are in world units; those that are 0 are chosen from `typical_radius`.
struct TubeSettings {
  TubeStyle style = TubeStyle::solid;
  TubeCaps caps = TubeCaps::flat;  ///< Of solid tubes, and of the wires that run along tubes.

  /// How far the triangles may be off the smooth tube: sets the number of rings, with the curvature and the ellipses'
  /// change, and of segments around, with their size. The best choice is a fraction of a pixel's size. 0: 1/50.
  double tolerance = 0;
  int least_segments = 6;  ///< Around; 3 or more.
  int most_segments = 64;  ///< Around; no fewer than the least.

  double spacing = 0;      ///< Between the ellipses of the wire and disc styles, along the tube. 0: 2.
  double wire_radius = 0;  ///< 0: 1/20.
  int lines = 8;           ///< Of the wire style, along the tube; >= 0.
  double thickness = 0;    ///< Of discs. 0: 1/10.

  /// What bounds the memory: a solid tube's triangle takes some 34 bytes here, and some 70 more in a ray tracer.
  std::uint64_t most_triangles = 250'000'000;  ///< At most 2^31.
};

/// Triangles, counter-clockwise from outside, with what shading needs at each vertex. Vertices are shared by the
/// triangles of a smooth surface; at the sharp edge of a flat cap there are two at one place.
struct TubeMesh {
  TriangleMesh mesh;
  std::vector<Eigen::Vector3f> normals;  ///< Unit, outwards; one for each vertex, as the values.
  std::vector<float> values;
  std::vector<std::uint32_t> tube_ends;  ///< For each tube in order, how many triangles it and those before it have.
};

/// The median of |x| over all points: the tubes' typical size. 0 where there is none.
double typical_radius(const std::vector<Tube>& tubes);

/// Runs on all threads; the result does not depend on their number. Tubes that are moved in are given back on the way.
/// A solid tube has at most 64 rings for each of its points; the other styles have an ellipse at every `spacing`.
/// Where a tube bends more tightly than it is thick its surface runs through itself.
/// @throw std::invalid_argument if a setting or a point is out of range; std::runtime_error if there are more triangles
/// than the settings allow (before they are all made: what is in memory stays near the limit).
TubeMesh make_tube_mesh(std::vector<Tube> tubes, const TubeSettings& settings);

}  // namespace tensorray
