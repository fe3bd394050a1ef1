// `continue_values` of coefficients.h.

#include <algorithm>

#include <tbb/parallel_for.h>

#include "volumes/bricks/coefficients.h"

namespace tensorray {
namespace {

using Eigen::Vector3i;

/// A voxel that is to be continued.
struct Continued {
  BrickVoxel voxel;
  bool is_known = false;
  StoredTensor value;
};

/// (3 − √3) / 6: where all voxels of a half space have the value 1, this is that of the spline, whose coefficients
/// beyond are zero, at the first voxel beyond. It falls to zero from there without a change of sign, and hardly rings
/// within.
constexpr float faded = 0.21132487f;

/// The continuation to the voxel at `index`, if one leads there.
void continue_to(const Vector3i& index, const CoefficientBricks& bricks, const std::vector<VoxelMask>& known,
                 Border border, const CoefficientMemory& memory, Continued& to) {
  const int longest = border == Border::extend ? 2 : 1;
  int most = 0, count = 0;
  StoredTensor sum = StoredTensor::Zero();
  for (int direction = 0; direction < 6; ++direction) {
    Vector3i along = Vector3i::Zero();
    along[direction / 2] = direction % 2 ? 1 : -1;
    StoredTensor values[2];
    int length = 0;
    for (; length < longest; ++length) {
      const auto voxel = find_voxel(bricks, known, index + (length + 1) * along);
      if (!voxel) break;
      values[length] = read_coefficient(memory, *voxel);
    }
    if (length == 0 || length < most) continue;
    if (length > most) {
      most = length;
      count = 0;
      sum.setZero();
    }
    sum += length == 2 ? StoredTensor(2 * values[0] - values[1]) : values[0];
    ++count;
  }
  to.is_known = count > 0;
  if (count > 0) to.value = sum * ((border == Border::fade ? faded : 1.0f) / static_cast<float>(count));
}

}  // namespace

void continue_values(const CoefficientBricks& bricks, Border border, const CoefficientMemory& memory) {
  std::vector<VoxelMask> known = bricks.active;
  std::vector<Continued> rest;
  for (std::size_t i = 0; i < bricks.places.size(); ++i)
    for (int x = 0; x < TensorBlock::size; ++x)
      for (int y = 0; y < TensorBlock::size; ++y)
        for (int z = 0; z < TensorBlock::size; ++z)
          if (is_set(bricks.filled[i], x, y, z) && !is_set(known[i], x, y, z))
            rest.push_back({{i, x, y, z}, false, StoredTensor::Zero()});
  // Each sweep leads one voxel further; those beside TensorBlock::sizes and corners are reached along one axis after
  // the other.
  while (!rest.empty()) {
    tbb::parallel_for(std::size_t{0}, rest.size(), [&](std::size_t i) {
      const BrickVoxel& voxel = rest[i].voxel;
      const Vector3i index = TensorBlock::size * bricks.places[voxel.brick] + Vector3i(voxel.x, voxel.y, voxel.z);
      continue_to(index, bricks, known, border, memory, rest[i]);
    });
    const auto end = std::partition(rest.begin(), rest.end(), [](const Continued& c) { return !c.is_known; });
    if (end == rest.end()) return;
    for (auto done = end; done != rest.end(); ++done) {
      const BrickVoxel& voxel = done->voxel;
      write_coefficient(done->value, memory, voxel.brick, voxel.number());
      std::uint8_t& row = known[voxel.brick][static_cast<std::size_t>(voxel.x * TensorBlock::size + voxel.y)];
      row = static_cast<std::uint8_t>(row | 1u << voxel.z);
    }
    rest.erase(end, rest.end());
  }
}

}  // namespace tensorray
