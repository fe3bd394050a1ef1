#pragma once
/// @file volumes/bricks/cubic_brick.h
/// The layouts of coefficients in bricks and blocks, and the B-spline's weights.

#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// 8³ cells with the coefficients that a cubic B-spline needs in them: from −1 to 9 along each axis, 11³ in all. What
/// is stored of a coefficient is what a TensorBrick stores of a tensor; coefficients follow each other without gaps.
struct CubicBrick {
  static constexpr int cells = TensorBrick::cells;
  static constexpr int before = 1, behind = 2;  ///< Coefficients before the first cell, and behind 8, along each axis.
  static constexpr int width = before + cells + behind;
  static constexpr int coefficients = width * width * width;

  /// The number of the coefficient at a voxel of the brick; each coordinate is from −1 to 9.
  static constexpr int coefficient(int x, int y, int z) {
    return ((x + before) * width + y + before) * width + z + before;
  }
  static constexpr int bending_offset(int components, int number) { return number * components; }
  static constexpr int trailing_offset(int components) { return (coefficients * components + 15) / 16 * 16; }
  static constexpr int stored_floats(int components) {
    return (trailing_offset(components) + coefficients + 15) / 16 * 16;
  }
};

/// A TensorBrick, whose coefficients are the tensors at its voxels, as CubicBrick has them.
struct LinearBrick {
  static constexpr int before = 0, behind = 1;
  static constexpr int width = TensorBrick::width;
  static constexpr int coefficients = TensorBrick::voxels;

  static constexpr int coefficient(int x, int y, int z) { return TensorBrick::voxel(x, y, z); }
  static constexpr int bending_offset(int components, int number) {
    return TensorBrick::bending_offset(components, number);
  }
  static constexpr int trailing_offset(int components) { return TensorBrick::trailing_offset(components); }
  static constexpr int stored_floats(int components) { return TensorBrick::stored_floats(components); }
};

/// The layout of a block's 8³ voxels, whose values become coefficients: of each what a brick stores.
struct CoefficientBlock {
  static constexpr int coefficients = TensorBlock::voxels;

  /// The number of the coefficient at a voxel of the block; each coordinate is from 0 to 7.
  static constexpr int coefficient(int x, int y, int z) { return (x * TensorBlock::size + y) * TensorBlock::size + z; }
  static constexpr int bending_offset(int components, int number) { return number * components; }
  static constexpr int trailing_offset(int components) { return coefficients * components; }
  static constexpr int stored_floats(int components) { return coefficients * (components + 1); }
};

/// Weights of the four coefficients about a point, the first one of them before its cell. @param t  In the cell, 0
/// to 1.
template <class Number>
void cubic_weights(Number t, Number (&weights)[4]) {
  const Number u = 1 - t;
  weights[0] = u * u * u / 6;
  weights[1] = Number(2) / 3 - t * t * (2 - t) / 2;
  weights[2] = Number(2) / 3 - u * u * (2 - u) / 2;
  weights[3] = t * t * t / 6;
}

/// The derivatives of these weights.
template <class Number>
void cubic_slopes(Number t, Number (&slopes)[4]) {
  const Number u = 1 - t;
  slopes[0] = -u * u / 2;
  slopes[1] = t * (3 * t - 4) / 2;
  slopes[2] = -u * (3 * u - 4) / 2;
  slopes[3] = t * t / 2;
}

}  // namespace tensorray
