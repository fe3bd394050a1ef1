#include "volumes/bricks/brick_making.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <tuple>

#include <tbb/parallel_sort.h>

#include "volumes/bricks/tensor_field.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

constexpr int cells = TensorBrick::cells;
static_assert(cells == TensorBlock::size, "a brick holds a block and the near faces of its neighbours");

/// The offset of a neighbour, 0 or 1 along each axis, from the bits of a number: bit 0 is x, bit 1 is y, bit 2 is z.
Eigen::Vector3i corner(int bits) { return {bits & 1, bits >> 1 & 1, bits >> 2 & 1}; }

/// The preceding bricks whose aprons contain an active voxel of `block`. Bit i is the brick at the place of the
/// block minus corner(i).
std::bitset<8> shared_faces(const TensorBlock& block) {
  std::bitset<8> touched;
  if (block.active.all()) return touched.set();
  for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
    if (!block.active[offset]) continue;
    const Eigen::Vector3i p = TensorBlock::position(offset);
    const int faces = (p.x() == 0) | (p.y() == 0) << 1 | (p.z() == 0) << 2;
    for (int before = 0; before < 8; ++before)
      if ((before & faces) == before) touched.set(before);
  }
  return touched;
}

/// Writes T − T₂₂ I (eight floats) and T₂₂.
void copy_voxel(const Eigen::Matrix3f& T, float* bending, float* trailing) {
  const float first = T(0, 0), middle = T(1, 1), last = T(2, 2);
  using Eight = Eigen::Array<float, TensorBrick::bending_floats, 1>;
  Eigen::Map<Eight>{bending} = Eigen::Map<const Eight>(T.data());  // Two vector copies; memmove would be a call.
  bending[0] = first - last;
  bending[4] = middle - last;
  *trailing = last;
}

/// Copies the voxels that a block and a brick share.
/// @param ahead  Offset of the block from the brick, 0 or 1 along each axis.
void copy_shared_voxels(const TensorBlock& block, const Eigen::Vector3i& ahead, float* floats) {
  const auto count = [&](int axis) { return ahead[axis] == 0 ? cells : 1; };
  const Eigen::Vector3i first = ahead * cells;
  for (int x = 0; x < count(0); ++x)
    for (int y = 0; y < count(1); ++y) {
      const Eigen::Matrix3f* const from = &block.values[static_cast<std::size_t>(TensorBlock::offset(x, y, 0))];
      const int to = TensorBrick::voxel(x + first.x(), y + first.y(), first.z());
      for (int z = 0; z < count(2); ++z)
        copy_voxel(from[z], floats + (to + z) * TensorBrick::bending_floats,
                   floats + TensorBrick::trailing_offset + to + z);
    }
}

/// The squared Frobenius norm of the deviator of T, from the eight floats of T − T₂₂ I.
double squared_deviator(const float* bending) {
  double squares = 0;
  for (int i = 0; i < TensorBrick::bending_floats; ++i) squares += double{bending[i]} * bending[i];
  const double trace = double{bending[0]} + bending[4];
  return std::max(0.0, squares - trace * trace / 3);
}

/// In double precision, for values of any size; NaN counts as zero.
double greatest_squared_deviator(const float* brick) {
  double greatest = 0;
  for (int voxel = 0; voxel < TensorBrick::voxels; ++voxel)
    greatest = std::max(greatest, squared_deviator(brick + voxel * TensorBrick::bending_floats));
  return greatest;
}

/// Computes TensorBrick::strongest from the floats of a brick.
float strongest_deviator(const float* brick) {
  // The relative error of single precision is below 2e-6 here, because the trace takes at most two thirds of the
  // squares away.
  float greatest = 0, sum = 0;
  for (const float* T = brick; T != brick + TensorBrick::trailing_offset; T += TensorBrick::bending_floats) {
    const Eigen::Map<const Eigen::Array4f> near(T), far(T + 4);  // One vector register each.
    const float squares = (near * near + far * far).sum(), trace = T[0] + T[4];
    greatest = std::max(greatest, squares - trace * trace * (1.0f / 3));
    sum += squares;  // Not finite if any value is not.
  }
  constexpr float least = 1e-25f, most = 1e30f;  // Outside this range squares may underflow or overflow.
  const double squared = greatest > least && sum < most ? double{greatest} : greatest_squared_deviator(brick);
  // Rounded up, because interpolation may round to slightly more than the tensor of any voxel.
  return static_cast<float>(std::sqrt(squared) * (1 + 1.2e-5));
}

}  // namespace

BlockTable::BlockTable(const TensorGrid& grid) {
  places.reserve(grid.blocks.size());
  blocks.reserve(grid.blocks.size());
  for (const TensorBlock& block : grid.blocks) {
    make_room();
    places.emplace_back(block.origin / cells);
    blocks.push_back(&block);
  }
  index = BrickIndex(places);
}

std::vector<Eigen::Vector3i> active_bricks(const BlockTable& table, const Eigen::AlignedBox3i& extent) {
  std::vector<Eigen::Vector3i> bricks;
  bricks.reserve(table.places.size());
  for (std::size_t i = 0; i < table.places.size(); ++i) {
    make_room();
    if (extent.contains(table.places[i])) bricks.push_back(table.places[i]);
    for (int before = 1; before < 8; ++before) {
      const Eigen::Vector3i brick = table.places[i] - corner(before);
      if (extent.contains(brick) && !table.find(brick) && shared_faces(*table.blocks[i])[before])
        bricks.push_back(brick);
    }
  }
  tbb::parallel_sort(bricks.begin(), bricks.end(), [](const Eigen::Vector3i& a, const Eigen::Vector3i& b) {
    return std::make_tuple(a.x(), a.y(), a.z()) < std::make_tuple(b.x(), b.y(), b.z());
  });
  bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
  return bricks;
}

float make_brick(const BlockTable& table, const Eigen::Vector3i& brick, float* floats) {
  for (int bits = 0; bits < 8; ++bits)
    if (const TensorBlock* const block = table.find(brick + corner(bits)))
      copy_shared_voxels(*block, corner(bits), floats);
  return strongest_deviator(floats);
}

}  // namespace tensorray
