#pragma once
/// @file volumes/bricks/brick_making.h
/// Makes the bricks of a TensorField from blocks, one block at a time and in any order.

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "volumes/bricks/brick_index.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// Outside this range, sums of squares in single precision may be wrong: a term may underflow or overflow.
constexpr float least_square = 1e-25f, greatest_square = 1e30f;

/// Number of bricks that hold voxels of one block: that at its place, and seven preceding ones, whose aprons its near
/// faces are.
constexpr int bricks_of_block = 8;

/// The offset of a block from one of its bricks, 0 or 1 along each axis, from the bits of a number: bit 0 is x, bit 1
/// is y, bit 2 is z.
inline Eigen::Vector3i corner(int bits) { return {bits & 1, bits >> 1 & 1, bits >> 2 & 1}; }

/// Finds blocks by their places (index of the first voxel / 8). Does not own the shapes.
struct BlockTable {
  explicit BlockTable(const std::vector<BlockShape>& shapes);

  const std::vector<BlockShape>& shapes;
  std::vector<Eigen::Vector3i> places;
  BrickIndex index;
};

/// Orders places by x, then y, then z, and removes those that are there twice.
void sort_places(std::vector<Eigen::Vector3i>& places);

/// The range of bricks that hold the cells between the voxels of a box. An axis with a single voxel has one cell.
Eigen::AlignedBox3i bricks_of(const Eigen::AlignedBox3i& voxels);

/// The bricks within `extent` that have an active voxel at a corner of one of their cells, ordered by x, then y, then
/// z. Each block gives the brick at its place. An active voxel on a near face of a block also gives the preceding
/// brick, whose apron contains that voxel.
std::vector<Eigen::Vector3i> active_bricks(const BlockTable& table, const Eigen::AlignedBox3i& extent);

/// What the bricks need to know of a block's voxels: entry i is for the brick that is corner(i) before it.
struct BlockShare {
  std::array<float, bricks_of_block> strongest;  ///< Greatest squared norm of a deviator.
  std::array<float, bricks_of_block> squares;    ///< Sum of the squares; not finite if one is not.
  double norm;                                   ///< Greatest squared norm of a tensor.
};

/// Copies the voxels of a block to its bricks, in the layout of TensorBrick.
/// @param components  Of the bricks.
/// @param bricks      Entry i is the brick that is corner(i) before the block; null: there is no such brick.
/// @return nothing, and leaves the bricks as they are, if they are symmetric and the block is not: T = Tᵀ in all
/// voxels, bit for bit.
std::optional<BlockShare> place_block(const TensorBlock& block, int components,
                                      const std::array<float*, bricks_of_block>& bricks);

/// Copies the voxels of a block to the layout of CoefficientBlock. @return the greatest squared norm of a tensor;
/// nothing, and leaves the copy as it is, if that is of symmetric tensors and the block is not.
std::optional<double> place_values(const TensorBlock& block, int components, float* values);

/// Copies a brick of symmetric tensors to one of tensors of any kind.
void widen_brick(const float* symmetric, float* general);

/// The greatest squared Frobenius norm of the deviators of tensors, from T − T₂₂ I. NaN counts as zero.
template <class Number>
struct Deviators {
  Number greatest = 0, squares = 0;  ///< Of a deviator, and of T − T₂₂ I.

  /// @param stored  The stored components of T − T₂₂ I.
  template <int components>
  void add(const float* stored) {
    const auto component = [&](int k) { return Number(stored[TensorBrick::stored_component(components, k)]); };
    Number sum = 0;
    for (int k = 0; k < TensorBrick::general; ++k) sum += component(k) * component(k);
    const Number trace = component(0) + component(4);
    squares = std::max(squares, sum);
    greatest = std::max(greatest, sum - trace * trace / 3);
  }

  /// Whether no square underflows or overflows, nearly. In single precision the error is then below 2e-6, because the
  /// trace takes at most two thirds of the squares away.
  bool are_exact() const { return greatest > Number(least_square) && squares < Number(greatest_square); }
};

/// TensorBrick::strongest, given the square. Rounded up, because interpolation may round to slightly more than the
/// tensor of any voxel.
inline float strongest_bound(double squared) { return static_cast<float>(std::sqrt(squared) * (1 + 1.2e-5)); }

/// TensorBrick::strongest of a brick. @param shares  Of the blocks, in the order of the table.
/// @param brick  The brick at `place`; it is complete but for `strongest`.
float strongest_deviator(const BlockTable& table, const std::vector<BlockShare>& shares, const Eigen::Vector3i& place,
                         const TensorBrick& brick);

}  // namespace tensorray
