#pragma once
/// What of a measured field is noise: the field without its structure, for a picture beside that of the field.

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// Root mean square distance (Frobenius) of the active voxels' tensors from their mean: the structure, and the noise.
double variation(const TensorGrid& grid);

/// Replaces each tensor by the isotropic tensor of the field's mean trace, which bends no light, and the noise of
/// another voxel: the voxels' differences from a Gaussian of one voxel about them, in random order, and stronger by
/// what that mean has taken away of noise that is independent from voxel to voxel. Sharp edges are in them, too, so
/// that they are no less than the noise. The same in every run.
/// @param grid  All values finite. @throw std::invalid_argument if it has several levels.
void keep_noise(TensorGrid& grid);

}  // namespace tensorray
