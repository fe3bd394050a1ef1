#pragma once
/// @file volumes/bricks/brick_making.h
/// What the bricks of a TensorField are made of: places, the values of blocks, and bounds of their norms.

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
constexpr float min_square = 1e-25f, max_square = 1e30f;

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

/// Copies the voxels of a block to the layout of CoefficientBlock. @return the greatest squared norm of a tensor;
/// nothing, if the copy is of symmetric tensors and the block is not: T = Tᵀ in all voxels, bit for bit.
std::optional<double> place_values(const TensorBlock& block, int components, float* values);

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
  bool are_exact() const { return greatest > Number(min_square) && squares < Number(max_square); }
};

/// TensorBrick::strongest, given the square. Rounded up, because interpolation may round to slightly more than the
/// tensor of any voxel.
inline float strongest_bound(double squared) { return static_cast<float>(std::sqrt(squared) * (1 + 1.2e-5)); }

}  // namespace tensorray
