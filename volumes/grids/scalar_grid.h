#pragma once
/// @file volumes/grids/scalar_grid.h
/// Numbers at the voxels of a sparse grid: values computed from a tensor field, or from the light in it, for other
/// programs.

#include <array>
#include <bitset>
#include <deque>
#include <map>
#include <string>

#include <Eigen/Geometry>

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// 8³ voxels, in the order of a TensorBlock. Inactive voxels hold zero.
struct ScalarBlock {
  Eigen::Vector3i origin = Eigen::Vector3i::Zero();  ///< Index of the first voxel; a multiple of 8 in each axis.
  std::bitset<TensorBlock::voxels> active;
  std::array<float, TensorBlock::voxels> values{};
};

/// A sparse grid of numbers. Plain data; voxel (i, j, k) has its centre at `to_world` * (i, j, k).
struct ScalarGrid {
  std::string name;
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();  ///< From index to world space; invertible.
  std::deque<ScalarBlock> blocks;  ///< Each has at least one active voxel; ordered by origin (x, then y, then z).
  bool fog = false;                ///< Whether values are a density that is zero in empty space (OpenVDB: fog volume).
  std::map<std::string, std::string> metadata;  ///< `tensorray:units`, `tensorray:source`, ...
};

}  // namespace tensorray
