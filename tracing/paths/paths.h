#pragma once
/// Bent rays as polylines with the field's tensor along them (Zheng and Pang 2003, the first of the paper's three
/// methods).

#include <optional>
#include <vector>

#include "base/process/progress.h"
#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"

namespace tensorray {

class Job;

/// A point and direction of a path, and its light.
struct PathSeed {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();     ///< World; inside or outside the volume.
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitZ();  ///< Direction of the light here; unit.
  double flexibility = 0.2;                               ///< s; any sign.
  double wavelength = 0;                                  ///< nm; copied to the path.
};

struct PathSettings {
  /// Whether light is also followed back from the seed to its source. Reversed light is traced with −s: V' changes sign
  /// with V, so that with −s it retraces its path.
  bool backwards = true;
  bool outside = false;  ///< Whether to keep the straight parts in front of and behind the volume.

  /// Whether points have `tensor` and `change`. Without these, more points are left out.
  bool tensors = true;

  /// Points are left out where linear interpolation between the remaining points errs by no more than both tolerances.
  double tolerance = 0.05;         ///< In position, in voxels; >= 0.
  double tensor_tolerance = 0.02;  ///< In T, a part of its greatest norm there; >= 0. Unused without tensors.

  Job* job = nullptr;  ///< Whose ranks trace the paths together, and all have them; null: alone.
};

/// The path of one ray, in the light's direction. Points are those that `trace` records, thinned; lengths increase from
/// zero at the first point. Where light enters or leaves the field, T jumps: one point is on the face, in the field,
/// and another one is outside, nearer to it than the tolerance.
struct Path {
  PathPoints points;  ///< Two or more; or none, if the light does not meet the volume.
  double flexibility = 0;
  double wavelength = 0;
  RayEnd end = RayEnd::missed;         ///< Why the path ends.
  std::optional<RayEnd> backward_end;  ///< Why the ray ended at the path's beginning, if it was followed backwards.
};

/// One path for each seed, in the order of the seeds. The result is the same for any number of threads
/// and ranks. @throw std::invalid_argument if a setting is out of range; Cancelled; as Ranks::all_gather.
std::vector<Path> trace_paths(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                              const std::vector<PathSeed>& seeds, const PathSettings& settings,
                              const Progress& progress);

}  // namespace tensorray
