#pragma once
/// @file tracing/paths/joined_ray.h
/// A ray that was traced backwards and forwards from its seed, as one ray in the light's direction.

#include <cstddef>
#include <vector>

#include "tracing/bending/bending.h"

namespace tensorray {

/// Steps of packets that follow each other.
struct StepRun {
  const StepPoint* first = nullptr;
  std::ptrdiff_t stride = 1;  ///< −1 for steps that were traced backwards.
  std::size_t count = 0;
  double entry_length = 0;  ///< Length of the traced ray where it entered the field.

  const StepPoint& operator[](std::size_t i) const { return first[stride * static_cast<std::ptrdiff_t>(i)]; }
};

/// A point, and the steps between it and the next one.
struct JoinedPoint {
  PathPoint point;
  StepRun steps;
};

/// The points of a ray. Most steps are in the runs between the points. It refers to the records of which it was made.
struct JoinedRay {
  std::vector<JoinedPoint> points;
  double seed_length = 0;  ///< Length of the path up to the seed.

  double length(const StepRun& run, std::size_t i) const {
    return seed_length + static_cast<double>(run.stride) * (run.entry_length + double{run[i].length});
  }
};

/// Joins the part behind the seed, which was traced backwards, and the part in front of it. Both begin at the seed.
/// @param back  Empty if light was not followed back.
/// @param ray   Set; keeps its memory.
void join(const TensorField& field, const RayRecord& back, const RayRecord& on, JoinedRay& ray);

/// Point i of a run.
PathPoint path_point(const TensorField& field, const JoinedRay& ray, const StepRun& run, std::size_t i);

/// Removes the straight parts in front of and behind the volume.
void remove_outside(JoinedRay& ray);

/// Makes lengths increase from point to point: separates the pairs of points where the field begins or ends by `gap`,
/// and removes points that are nearer to the one before them than `least`.
void remove_coincident(JoinedRay& ray, double gap, double least);

}  // namespace tensorray
