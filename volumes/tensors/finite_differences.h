#pragma once
/// Tensors derived from vectors or scalars at the voxels of a sparse grid.

#include <array>
#include <deque>

#include <Eigen/Core>

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// Vectors at 8³ voxels, or scalars in the first component. Voxels are in the order of TensorBlock.
struct SampleBlock : BlockShape {
  std::array<Eigen::Vector3d, TensorBlock::voxels> values;

  SampleBlock() { values.fill(Eigen::Vector3d::Zero()); }
};

using SampleBlocks = std::deque<SampleBlock, SlotAllocator<SampleBlock>>;

// Differences use active voxels only. They are central inside the active region and one-sided at its edge, where they
// are of second order if the region is three voxels deep. The field counts as constant along a direction without an
// active neighbour.
// `blocks` must be ordered by origin. The result has the same order and the same active voxels. Runs on all threads.
// @param to_index  The linear part of the transform from world to index space.

/// T(i, j) = ∂v_i/∂x_j, world axes.
TensorBlocks gradient(const SampleBlocks& blocks, const Eigen::Matrix3d& to_index);

/// The same of a staggered grid (marker and cell): component i of a voxel is at the middle of its face towards −i, in
/// index space. T is at the centres of the voxels: along i, the difference of the two faces of the voxel; along the
/// other axes, differences of the mean of the two faces. The values are exact for quadratic components inside the
/// active region, where the next voxel is active, too.
TensorBlocks staggered_gradient(const SampleBlocks& blocks, const Eigen::Matrix3d& to_index);

/// T(i, j) = ∂²f/∂x_i∂x_j, world axes; exactly symmetric.
TensorBlocks hessian(const SampleBlocks& blocks, const Eigen::Matrix3d& to_index);

/// The viscous stress where a fluid of viscosity 1 has the velocity gradient T: T + Tᵀ − ⅔ tr T I, symmetric.
template <class Matrix>
Matrix viscous_stress(const Matrix& T) {
  using Scalar = typename Matrix::Scalar;
  return T + T.transpose() - Scalar(2) / 3 * T.trace() * Matrix::Identity();
}

}  // namespace tensorray
