#pragma once
/// @file volumes/making/smoothing.h
/// Normalised convolution of a field with a Gaussian, for measurements with noise, such as diffusion tensors.

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

constexpr double max_smoothing = 20;  ///< Voxels: a thread's memory grows with the cube of the deviation.

/// Each active voxel becomes Σ w T / Σ w over the active voxels about it, w = exp(−(x² + y² + z²) / 2σ²), where x, y
/// and z are distances in voxels, each at most 4σ. Inactive voxels neither count nor change, so that a border does not
/// darken the field. A constant field stays the same, bit for bit; a symmetric one stays symmetric.
/// Runs on all threads; the result does not depend on their number. Takes the memory of a second grid.
/// @param grid       All values finite.
/// @param deviation  σ, voxels along each axis of the grid; 0 to `max_smoothing`. Below 1/4 nothing changes.
/// @throw std::invalid_argument if the deviation is out of range, or the grid has several levels.
void smooth(TensorGrid& grid, double deviation);

}  // namespace tensorray
