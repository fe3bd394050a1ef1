// `continue_values` of coefficients.h.

#include <atomic>
#include <cstddef>

#include <tbb/parallel_for.h>

#include "volumes/bricks/coefficients.h"

namespace tensorray {
namespace {

using Eigen::Vector3i;

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
