#pragma once
/// @file volumes/tensors/finite_differences.h
/// Tensors derived from vectors or scalars at the voxels of a sparse grid.

#include <array>
#include <bitset>
#include <vector>

#include <Eigen/Core>

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// Vectors, or scalars in the first component, of 8³ voxels; laid out as in TensorBlock.
struct SampleBlock {
  Eigen::Vector3i origin = Eigen::Vector3i::Zero();
  std::bitset<TensorBlock::voxels> active;
  std::array<Eigen::Vector3d, TensorBlock::voxels> values;

  SampleBlock() { values.fill(Eigen::Vector3d::Zero()); }
};

// Differences run over active voxels only: central ones inside; at the edge of the active region one-sided ones, of
// second order where it is three voxels deep. A direction without an active neighbour counts as constant.
// `blocks` are ordered by origin, and so is the result, which has the same active voxels. On all threads.
// @param to_index  The linear part of the transform from world to index space.

/// T(i, j) = ∂v_i/∂x_j, world axes.
TensorBlocks gradient(const std::vector<SampleBlock>& blocks, const Eigen::Matrix3d& to_index);

/// T(i, j) = ∂²f/∂x_i∂x_j, world axes; exactly symmetric.
TensorBlocks hessian(const std::vector<SampleBlock>& blocks, const Eigen::Matrix3d& to_index);

}  // namespace tensorray
