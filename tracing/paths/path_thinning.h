#pragma once
/// @file tracing/paths/path_thinning.h
/// Chooses the points of a path that are needed, in single precision and in the vectors of the processor.

#include <cstddef>
#include <vector>

#include "tracing/paths/path_samples.h"

namespace tensorray {

/// Points are left out where linear interpolation between the remaining points errs by no more than both tolerances.
/// @param tolerance         In position, in voxels; >= 0.
/// @param tensor_tolerance  In T, as a fraction of the greatest norm of T there; >= 0. Unused without tensors.
/// @return the points that stay, in order. The first and the last are among them.
std::vector<std::size_t> thinned(const PathSamples& samples, double tolerance, double tensor_tolerance);

}  // namespace tensorray
