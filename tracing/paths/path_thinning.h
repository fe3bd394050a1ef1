#pragma once
/// Joins the two parts of a path, and chooses the points that are needed: samples all of them in single precision,
/// component after component, and compares them in the vectors of the processor.

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

/// A ray that was traced backwards and forwards from its seed, as one ray in the light's direction. Most steps are in
/// the runs between the points. It refers to the records of which it was made.
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

/// The points of a path. Arrays keep their memory. They have room for whole vectors behind the last point.
struct PathSamples {
  std::size_t count = 0;
  std::size_t room = 0;              ///< From a component to the next one, in floats.
  std::vector<float> places;         ///< Index space, from a voxel near the path: x of all points, then y, then z.
  std::vector<float> positions;      ///< World axes, in sizes of a voxel: x, y, z.
  std::vector<float> lengths, more;  ///< Length of the path up to the point, world units: `lengths` + `more`.
  std::vector<float> tensors;  ///< Nine components, column by column, in greatest norms of the field; zero outside it.
};

/// Samples all points of a ray, which has some.
/// @param with_tensors  Otherwise `tensors` is empty.
void sample_path(const TensorField& field, const JoinedRay& ray, bool with_tensors, PathSamples& samples);

/// Points are left out where linear interpolation between the remaining points errs by no more than both tolerances.
/// @param tolerance         In position, in voxels; >= 0.
/// @param tensor_tolerance  In T, as a fraction of the greatest norm of T there; >= 0. Unused without tensors.
/// @return the points that stay, in order. The first and the last are among them.
std::vector<std::size_t> thinned(const PathSamples& samples, double tolerance, double tensor_tolerance);

}  // namespace tensorray
