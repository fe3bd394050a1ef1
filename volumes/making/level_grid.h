#pragma once
/// A level of a grid of several levels, as a grid of its own.

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// The blocks of a finer level, and those that have a voxel at most `reach` voxels beside them along each axis, within
/// the extent of level 0. What the level does not hold is interpolated: half way between voxels of the level before is
/// the mean of those that are active there; where none is, there is no voxel. Values of the level stay as they are.
/// Runs on all threads; the result does not depend on their number.
/// @param level  1 to the number of finer levels.
TensorGrid level_grid(const TensorGrid& grid, int level, int reach);

}  // namespace tensorray
