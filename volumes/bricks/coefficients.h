#pragma once
/// @file volumes/bricks/coefficients.h
/// From the voxels of a cubic field to the coefficients that its cells need.

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
/// polynomial (not a knot) at faces of the extent, and everywhere with `extend`; otherwise they are zero.
void make_coefficients(const CoefficientBricks& bricks, const Eigen::AlignedBox3i& extent, Border border,
                       const CoefficientMemory& memory);

/// Copies to each of the first bricks the coefficients of others that its cells need, and extrapolates those that are
/// outside the extent. @return TensorBrick::strongest of these bricks.
std::vector<float> finish_bricks(const CoefficientBricks& bricks, const Eigen::AlignedBox3i& extent, Border border,
                                 const CoefficientMemory& memory);

}  // namespace tensorray
