#pragma once
/// @file integrators/paths/paths.h
/// The bent rays themselves (Zheng and Pang 2003, the first of the paper's three methods), as polylines with what the
/// field does along them.

#include <optional>
#include <vector>

#include "base/progress.h"
#include "integrators/bending/bending.h"

namespace tensorray {

/// Where a path is caught, and which light it is.
struct PathSeed {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();     ///< World; outside the volume or inside.
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitZ();  ///< Of the light here; unit.
  double flexibility = 0.2;                               ///< s; any sign.
  double wavelength = 0;                                  ///< nm; carried along.
};

struct PathSettings {
  /// Whether light is also followed back from the seed to where it comes from. Reversed light bends with −s: V' changes
  /// sign with V, so that only so does it go back the way that it came.
  bool backwards = true;
  bool outside = false;  ///< Whether to keep the straight parts before and behind the volume.

  /// Points are left out where those kept imply them: linear interpolation errs by at most this much in position, ...
  double tolerance = 0.05;         ///< ... in voxels; >= 0.
  double tensor_tolerance = 0.02;  ///< ... and in T, of the greater norm of its ends; >= 0.
};

/// What one ray has left, in the light's direction: points as `trace` records them, thinned, with lengths that grow
/// from zero at the first one. Where light enters or leaves the field, T jumps: one point is on the face, within the
/// field, and another one before or behind it, nearer than the tolerance.
struct Path {
  PathPoints points;  ///< Two or more; or none, where the light does not meet the volume.
  double flexibility = 0;
  double wavelength = 0;
  RayEnd end = RayEnd::missed;         ///< Why it ends.
  std::optional<RayEnd> backward_end;  ///< Why it ends at its beginning, if it was followed there.
};

/// One path for each seed, in their order; the same for any number of threads.
/// @throw std::invalid_argument if a setting is out of range; Cancelled.
std::vector<Path> trace_paths(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                              const std::vector<PathSeed>& seeds, const PathSettings& settings,
                              const Progress& progress);

}  // namespace tensorray
