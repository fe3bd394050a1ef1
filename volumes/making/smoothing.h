#pragma once
/// Normalised convolution of a field with a Gaussian, for measurements with noise, such as diffusion tensors.

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

constexpr double max_smoothing = 20;  ///< Voxels: a thread's memory grows with the cube of the deviation.

/// Each active voxel becomes Σ w T / Σ w over the active voxels about it, w = exp(−(x² + y² + z²) / 2σ²), where x, y
/// and z are distances in voxels, each at most 4σ. Inactive voxels neither count nor change, so that a border does not
/// darken the field. A constant field stays the same, bit for bit; a symmetric one stays symmetric.
/// Runs on all threads; the result does not depend on their number. Takes the memory of a second grid.
/// @param grid       All values finite.
/// Finer levels are smoothed by the same width in space, together with the coarser voxels about them.
/// @param deviation  σ, voxels of level 0 along each axis of the grid; 0 to `max_smoothing`, and so in voxels of the
///                   finest level. Levels of which it is below 1/4 of a voxel do not change.
/// @throw std::invalid_argument if the deviation is out of range.
void smooth(TensorGrid& grid, double deviation);

}  // namespace tensorray
