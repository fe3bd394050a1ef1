#pragma once
/// From the voxels of a field to the coefficients that its cells need.

#include <cstdint>
#include <optional>
#include <vector>

#include "volumes/bricks/coefficient_bricks.h"

namespace tensorray {

/// Memory of zeros for the bricks of a field, level after level. While a level is made, what is behind its bricks holds
/// its blocks, until bricks overwrite them.
BrickMemory brick_memory(const std::vector<CoefficientBricks>& levels, Interpolation between, int components);

/// Some of the bricks, whose memory it keeps.
BrickMemory bricks_from(const BrickMemory& memory, std::size_t first, std::size_t count);

/// The blocks of a level within the memory from its first brick, which they keep.
BrickMemory blocks_within(const BrickMemory& memory, const CoefficientBricks& bricks);

/// Outside this range, sums of squares in single precision may be wrong: a term may underflow or overflow.
constexpr float min_square = 1e-25f, max_square = 1e30f;

/// Copies the voxels of a block to the layout of CoefficientBlock. @return the greatest squared norm of a tensor;
/// nothing, if the copy is of symmetric tensors and the block is not: T = Tᵀ in all voxels, bit for bit.
std::optional<double> place_values(const TensorBlock& block, int components, float* values);

/// Continues the values of a field's active voxels to the others that have coefficients, as the mean of all axes
/// that lead to a voxel: with `extend` by a line through two voxels, or the value of a single one; with `fade` a fifth
/// of the neighbour's value.
void continue_values(const Coefficients& field);

/// Makes coefficients of a cubic field's values, in place, axis after axis: the cubic spline through the voxels of each
/// run of voxels that have coefficients. At the end of a run coefficients continue as a cubic polynomial (not a knot)
/// at faces of the extent, and everywhere with `extend`; otherwise they are zero. Then makes the bricks of any field,
/// which overwrite blocks that no other brick needs. It goes through all blocks twice. Of a finer level, a run that
/// ends where voxels are not free is zero beyond.
/// @param result  The memory that the blocks are within.
/// @return TensorBrick::strongest of the bricks.
std::vector<float> make_coefficients(const Coefficients& field, const BrickMemory& result);

/// Copies to each brick the coefficients that its cells need; of a cubic field, extrapolates those that are outside the
/// extent; of a finer level, adds those of the level before.
/// @param numbers  The bricks; numbers of other places are passed over. @param strongest  Gets TensorBrick::strongest
/// of the bricks.
void finish_bricks(const Coefficients& field, const PlaceNumbers& numbers, const BrickMemory& result,
                   std::vector<float>& strongest);

}  // namespace tensorray
