// `place_values` and `continue_values` of coefficients.h.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <tbb/parallel_for.h>

#include "volumes/bricks/coefficients.h"

namespace tensorray {
namespace {

using Eigen::Vector3i;

/// In double precision, for values of any size; NaN counts as zero.
double max_squared_norm(const TensorBlock& block) {
  double greatest = 0;
  for (const Eigen::Matrix3f& value : block.values) greatest = std::max(greatest, value.cast<double>().squaredNorm());
  return greatest;
}

/// @param norm  The greatest squared norm of a block's tensors in single precision.
double squared_norm(float norm, const TensorBlock& block) {
  return norm > min_square && norm < max_square ? double{norm} : max_squared_norm(block);
}

std::uint32_t bits_of(float number) {
  std::uint32_t bits;
  std::memcpy(&bits, &number, sizeof bits);
  return bits;
}

template <int components>
std::optional<double> place(const TensorBlock& block, float* values) {
  std::uint32_t asymmetry = 0;
  float greatest = 0;
  const auto square = [](float x) { return x * x; };
  for (int voxel = 0; voxel < TensorBlock::voxels; ++voxel) {
    const float* const T = block.values[voxel].data();
    asymmetry |= (bits_of(T[1]) ^ bits_of(T[3])) | (bits_of(T[2]) ^ bits_of(T[6])) | (bits_of(T[5]) ^ bits_of(T[7]));
    const float bending[] = {T[0] - T[8], T[1], T[2], T[3], T[4] - T[8], T[5], T[6], T[7]};
    float* const to = values + CoefficientBlock::bending_offset(components, voxel);
    if constexpr (components == TensorBrick::general)
      std::copy_n(bending, components, to);
    else
      for (const int i : {0, 1, 2, 4, 5}) to[TensorBrick::stored_component(components, i)] = bending[i];
    values[CoefficientBlock::trailing_offset(components) + voxel] = T[8];
    const float even = square(T[2]) + square(T[6]);
    const float odd = (square(T[1]) + square(T[5])) + (square(T[3]) + square(T[7]));
    const float norm = (((square(T[0]) + square(T[4])) + even) + odd) + square(T[8]);
    greatest = greatest < norm ? norm : greatest;
  }
  if (components == TensorBrick::symmetric && asymmetry != 0) return std::nullopt;
  return squared_norm(greatest, block);
}

/// (3 − √3) / 6: where all voxels of a half space have the value 1, this is that of the spline, whose coefficients
/// beyond are zero, at the first voxel beyond. It falls to zero from there without a change of sign, and hardly rings
/// within.
constexpr float faded = 0.21132487f;

/// The continuation to the voxel at `index`, if known voxels lead there: the mean of those along which most are known.
std::optional<StoredTensor> continuation(const Vector3i& index, const Coefficients& field,
                                         const std::vector<VoxelMask>& known) {
  const int longest = field.interpolant.border == Border::extend ? 2 : 1;
  int most = 1, count = 0;
  StoredTensor sum = StoredTensor::Zero();
  for (int direction = 0; direction < 6; ++direction) {
    const Vector3i along = (direction % 2 ? 1 : -1) * Vector3i::Unit(direction / 2);
    StoredTensor values[2];
    int length = 0;
    for (; length < longest; ++length) {
      const auto voxel = find_voxel(field.bricks, known, index + (length + 1) * along);
      if (!voxel) break;
      values[length] = read_coefficient(field.blocks, *voxel);
    }
    if (length < most) continue;
    if (length > most) {
      most = length;
      count = 0;
      sum.setZero();
    }
    sum += length == 2 ? StoredTensor(2 * values[0] - values[1]) : values[0];
    ++count;
  }
  if (count == 0) return std::nullopt;
  return StoredTensor(sum * ((field.interpolant.border == Border::fade ? faded : 1.0f) / static_cast<float>(count)));
}

/// Continues values to the voxels of a block that known ones lead to. @return the voxels that are known now.
VoxelMask continue_block(std::size_t block, const Coefficients& field, const std::vector<VoxelMask>& known) {
  VoxelMask result = known[block];
  for (int x = 0; x < TensorBlock::size; ++x)
    for (int y = 0; y < TensorBlock::size; ++y)
      for (int z = 0; z < TensorBlock::size; ++z) {
        if (!is_set(field.bricks.filled[block], x, y, z) || is_set(known[block], x, y, z)) continue;
        const Vector3i index = TensorBlock::size * field.bricks.places[block] + Vector3i(x, y, z);
        const auto value = continuation(index, field, known);
        if (!value) continue;
        write_coefficient<CoefficientBlock>(*value, field.blocks.components, field.blocks.brick(block),
                                            CoefficientBlock::coefficient(x, y, z));
        std::uint8_t& row = result[static_cast<std::size_t>(x * TensorBlock::size + y)];
        row = static_cast<std::uint8_t>(row | 1u << z);
      }
  return result;
}

}  // namespace

std::optional<double> place_values(const TensorBlock& block, int components, float* values) {
  return components == TensorBrick::symmetric ? place<TensorBrick::symmetric>(block, values)
                                              : place<TensorBrick::general>(block, values);
}

void continue_values(const Coefficients& field) {
  if (field.interpolant.between == Interpolation::linear) return;
  // Each sweep leads one voxel further; those beside edges and corners are reached along one axis after the other. A
  // sweep reads only voxels that were known before it.
  std::vector<VoxelMask> known = field.bricks.active, next = known;
  for (std::atomic<bool> changed{true}; changed;) {
    changed = false;
    tbb::parallel_for(std::size_t{0}, field.bricks.places.size(), [&](std::size_t i) {
      if (known[i] == field.bricks.filled[i]) return;
      next[i] = continue_block(i, field, known);
      if (next[i] != known[i]) changed = true;
    });
    known = next;
  }
}

}  // namespace tensorray
