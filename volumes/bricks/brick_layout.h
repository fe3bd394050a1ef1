#pragma once
/// How bricks, and the blocks that they are made of, hold coefficients: all that sampling needs to know of a layout.

namespace tensorray {

/// A block's 8³ coefficients, and those about it that the cells of a brick need: from −before to 7 + behind along each
/// axis. What is stored of a coefficient is what a TensorBrick stores of a tensor.
template <int before_voxels, int behind_voxels>
struct BrickLayout {
  static constexpr int cells = 8;
  static constexpr int before = before_voxels, behind = behind_voxels;
  static constexpr int width = before + cells + behind;  ///< Coefficients along an edge.
  static constexpr int coefficients = width * width * width;

  /// The number of the coefficient at a voxel of the block.
  static constexpr int coefficient(int x, int y, int z) {
    return ((x + before) * width + y + before) * width + z + before;
  }
  /// Offset of a coefficient's components from `TensorBrick::bending`, in floats; they follow each other without gaps.
  static constexpr int bending_offset(int components, int number) { return number * components; }
  /// Offset of `TensorBrick::trailing`. Both, and bricks, begin with a cache line.
  static constexpr int trailing_offset(int components) { return (coefficients * components + 15) / 16 * 16; }
  static constexpr int stored_floats(int components) {
    return (trailing_offset(components) + coefficients + 15) / 16 * 16;
  }
};

using LinearBrick = BrickLayout<0, 1>;  ///< 9³ tensors, for trilinear interpolation in 8³ cells.
using CubicBrick = BrickLayout<1, 2>;   ///< 11³ coefficients of a tricubic B-spline in 8³ cells.
using CoefficientBlock = BrickLayout<0, 0>;

}  // namespace tensorray
