#pragma once
/// @file volumes/bricks/coefficients.h
/// The B-spline coefficients of a field: which voxels have some, and how they follow from the voxels' values.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "volumes/bricks/brick_index.h"
#include "volumes/bricks/brick_making.h"
#include "volumes/bricks/interpolation.h"

namespace tensorray {

/// Which of a block's 8³ voxels: a row along z is a byte, whose bit z is voxel (x, y, z); rows are at 8 x + y.
using VoxelMask = std::array<std::uint8_t, TensorBlock::size * TensorBlock::size>;

/// The bricks of a cubic field. Each holds the coefficients of its own block of voxels, and, in the end, those about it
/// that its cells need.
struct CoefficientBricks {
  /// First the bricks with a cell where the field is not zero, ordered by x, then y, then z. Then those that only hold
  /// coefficients of other bricks' cells, until these have copies: of the extent's last voxels.
  std::vector<Eigen::Vector3i> places;
  std::size_t count = 0;  ///< Number of the first ones.
  BrickIndex index;       ///< Of all places.

  /// The voxels of each place that have coefficients: the active ones; and inactive ones within the extent that are
  /// within a voxel of these (`fade`) or two (`extend`) along each axis.
  std::vector<VoxelMask> filled;
  std::vector<VoxelMask> active;
};

/// @param extent  The box of the active voxels. Runs on all threads.
CoefficientBricks coefficient_bricks(const BlockTable& table, const Eigen::AlignedBox3i& extent, Border border);

/// The memory of bricks in the layout of CubicBrick.
struct CoefficientMemory {
  float* first;
  std::size_t stride;  ///< Floats of a brick.
  int components;

  float* brick(std::size_t i) const { return first + i * stride; }
};

/// Copies a block's voxels to the brick at its place. @return the greatest squared norm of a tensor; nothing, and
/// leaves the brick as it is, if the brick is symmetric and the block is not.
std::optional<double> place_values(const TensorBlock& block, int components, float* brick);

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
std::vector<float> finish_bricks(const CoefficientBricks& bricks, const Eigen::AlignedBox3i& extent,
                                 const CoefficientMemory& memory);

}  // namespace tensorray
