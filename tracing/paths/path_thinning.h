#pragma once
/// @file tracing/paths/path_thinning.h
/// Chooses the points of a path that are needed: samples all of them in single precision, component after component,
/// and compares them in the vectors of the processor.

#include <cstddef>
#include <vector>

#include "tracing/paths/joined_ray.h"

namespace tensorray {

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
