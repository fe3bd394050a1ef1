#pragma once
/// The finer levels of a field, as a hierarchical B-spline (D. Forsey and R. Bartels, Hierarchical B-spline refinement,
/// 1988). A spline on voxels of size h is one on voxels of size h / 2, whose coefficients follow from
/// B(x) = Σ m[k] B(2x − k), m = (1 4 6 4 1) / 8. A level adds details to it: coefficients of B-splines that are zero
/// outside the refined bricks, so that the sum is twice continuously differentiable across levels. Details interpolate
/// what is left of the level's values, axis after axis: exactly where the refined bricks are a box, and nearly at the
/// corners of other regions.

#include <vector>

#include "volumes/bricks/coefficient_bricks.h"

namespace tensorray {

/// The extent of the next level.
Eigen::AlignedBox3i finer_extent(const Eigen::AlignedBox3i& extent);

/// The bricks that the next level refines: those with cells within the extent in which one of its voxels is active.
/// @param shapes  Of the next level. @param extent  Of this one. @param existing  The bricks of this level; null: all.
std::vector<Eigen::Vector3i> refined_bricks(const std::vector<BlockShape>& shapes, const Eigen::AlignedBox3i& extent,
                                            const BrickIndex* existing);

/// The eight bricks within each of `refined` where the extent reaches, also those that only have voxels on its last
/// face. A voxel is free if its B-spline is zero outside of `refined`, within the extent.
/// @param extent  Of the level. Runs on all threads.
CoefficientBricks finer_bricks(const BlockTable& table, const std::vector<Eigen::Vector3i>& refined,
                               const Eigen::AlignedBox3i& extent, const Interpolant& interpolant);

/// Takes the coarser spline away from the active voxels of the block of place i, and sets the others to zero.
/// @param block  In the layout of CoefficientBlock.
void subtract_coarser(const Coefficients& field, std::size_t i, float* block);

/// Adds the coarser spline to the coefficients of a brick.
void add_coarser(const CoarserLevel& coarser, const Eigen::Vector3i& place, int components, float* brick);

}  // namespace tensorray
