#include "volumes/bricks/brick_making.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <tuple>

#include <tbb/parallel_sort.h>

#include "volumes/bricks/cubic_brick.h"

namespace tensorray {
namespace {

constexpr int cells = TensorBrick::cells;
static_assert(cells == TensorBlock::size, "a brick holds a block and the near faces of its neighbours");

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

}  // namespace

std::optional<double> place_values(const TensorBlock& block, int components, float* values) {
  return components == TensorBrick::symmetric ? place<TensorBrick::symmetric>(block, values)
                                              : place<TensorBrick::general>(block, values);
}

BlockTable::BlockTable(const std::vector<BlockShape>& all) : shapes(all) {
  places.reserve(shapes.size());
  for (const BlockShape& shape : shapes) places.emplace_back(shape.origin / cells);
  index = BrickIndex(places);
}

void sort_places(std::vector<Eigen::Vector3i>& places) {
  tbb::parallel_sort(places.begin(), places.end(), [](const Eigen::Vector3i& a, const Eigen::Vector3i& b) {
    return std::make_tuple(a.x(), a.y(), a.z()) < std::make_tuple(b.x(), b.y(), b.z());
  });
  places.erase(std::unique(places.begin(), places.end()), places.end());
}

Eigen::AlignedBox3i bricks_of(const Eigen::AlignedBox3i& voxels) {
  const auto brick_of = [](int cell) { return cell >> 3; };
  const Eigen::Vector3i last = (voxels.max().array() - 1).matrix().cwiseMax(voxels.min());
  return {voxels.min().unaryExpr(brick_of), last.unaryExpr(brick_of)};
}

}  // namespace tensorray
