#pragma once
/// @file volumes/bricks/coefficients.h
/// From the voxels of a cubic field to the coefficients that its cells need.

#include <cstdint>
#include <vector>

#include "volumes/bricks/coefficient_bricks.h"

namespace tensorray {

/// Copies a brick of symmetric tensors to one of tensors of any kind.
void widen_coefficients(const float* symmetric, float* general);

/// Continues the values of the active voxels to the others that have coefficients, as the mean of all axes that lead to
/// a voxel: with `extend` by a line through two voxels, or the value of a single one; with `fade` a fifth of the
/// neighbour's value.
void continue_values(const CoefficientBricks& bricks, Border border, const CoefficientMemory& memory);

/// Makes coefficients of the bricks' own voxels of their values, in place, axis after axis: the cubic spline through
/// the voxels of each run of voxels that have coefficients. At the end of a run coefficients continue as a cubic
/// polynomial (not a knot) at faces of the extent, and everywhere with `extend`; otherwise they are zero. Then finishes
/// the first bricks. If memory has a bound (page_memory.h), it goes through all bricks twice.
/// @return TensorBrick::strongest of the first bricks.
std::vector<float> make_coefficients(const CoefficientBricks& bricks, const Eigen::AlignedBox3i& extent, Border border,
                                     const CoefficientMemory& memory);

/// Numbers of bricks in CoefficientBricks.
using BrickNumbers = std::vector<std::uint32_t>;

/// Copies to each brick the coefficients of others that its cells need, and extrapolates those that are outside the
/// extent. @param numbers  The bricks; only the first ones are finished. @param strongest  TensorBrick::strongest of
/// them.
void finish_bricks(const CoefficientBricks& bricks, const BrickNumbers& numbers, const Eigen::AlignedBox3i& extent,
                   Border border, const CoefficientMemory& memory, std::vector<float>& strongest);

}  // namespace tensorray
