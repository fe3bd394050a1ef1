#include "volumes/bricks/tensor_field.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <tbb/parallel_for.h>

#include "base/box.h"
#include "volumes/bricks/brick_making.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

struct alignas(64) ZeroBrick {
  float floats[TensorBrick::stored_floats] = {};
};
constexpr ZeroBrick zero_brick;

/// The range of bricks that hold the cells between the voxels of a box. An axis with a single voxel has one cell.
Eigen::AlignedBox3i bricks_of(const Eigen::AlignedBox3i& voxels) {
  const auto brick_of = [](int cell) { return cell >> 3; };
  const Eigen::Vector3i last = (voxels.max().array() - 1).matrix().cwiseMax(voxels.min());
  return {voxels.min().unaryExpr(brick_of), last.unaryExpr(brick_of)};
}

/// Number of bricks that are made before blocks are freed; enough to keep all threads busy.
constexpr std::size_t enough_bricks = 4096;

/// The first index from `brick` on where x differs from the x before it; at most the number of bricks.
std::size_t end_of_layer(const std::vector<Eigen::Vector3i>& bricks, std::size_t brick) {
  while (brick < bricks.size() && bricks[brick].x() == bricks[brick - 1].x()) ++brick;
  return std::min(brick, bricks.size());
}

Eigen::AlignedBox3d extent_of(const Eigen::AlignedBox3i& active) {
  Eigen::AlignedBox3d extent(active.min().cast<double>(), active.max().cast<double>());
  for (int axis = 0; axis < 3; ++axis)
    if (active.sizes()[axis] == 0) {
      extent.min()[axis] -= 0.5;
      extent.max()[axis] += 0.5;
    }
  return extent;
}

}  // namespace

const TensorBrick TensorField::zeros{zero_brick.floats, zero_brick.floats + TensorBrick::trailing_offset, 0};

Eigen::Matrix3d TensorBrick::tensor(int voxel) const {
  Eigen::Matrix3d T;
  Eigen::Map<Eigen::Matrix<double, 8, 1>>(T.data()) =
      Eigen::Map<const Eigen::Matrix<float, 8, 1>>(bending + voxel * bending_floats).cast<double>();
  T(2, 2) = trailing[voxel];
  T(0, 0) += T(2, 2);
  T(1, 1) += T(2, 2);
  return T;
}

TensorField::TensorField(const TensorGrid& grid) : to_world_(grid.to_world), to_index_(grid.to_world.inverse()) {
  make_bricks(grid, [](int) {});
}

TensorField::TensorField(TensorGrid&& grid) : to_world_(grid.to_world), to_index_(grid.to_world.inverse()) {
  make_bricks(grid, [&](int x) {
    while (!grid.blocks.empty() && grid.blocks.front().origin.x() < x) grid.blocks.pop_front();
  });
  grid.blocks.clear();
}

/// @param give_back  Called as give_back(x) when no block whose origin is below x is needed any more.
template <class GiveBack>
void TensorField::make_bricks(const TensorGrid& grid, const GiveBack& give_back) {
  const Eigen::AlignedBox3i active = grid.active_box();
  if (active.isEmpty()) throw std::invalid_argument("the tensor field has no active voxel");
  if (!to_world_.matrix().allFinite() || !to_index_.matrix().allFinite())
    throw std::invalid_argument("the tensor field's transform cannot be inverted");
  index_bounds_ = extent_of(active);
  voxels_ = Eigen::AlignedBox3d(active.min().cast<double>(), active.max().cast<double>());

  const BlockTable blocks(grid);
  bricks_ = active_bricks(blocks, bricks_of(active));
  bricks_.shrink_to_fit();
  index_ = BrickIndex(bricks_);
  floats_ = allocate(bricks_.size());
  strongest_.resize(bricks_.size());
  for (std::size_t first = 0; first < bricks_.size();) {
    const std::size_t last = end_of_layer(bricks_, first + enough_bricks);
    tbb::parallel_for(first, last, [&](std::size_t i) {
      make_room();
      strongest_[i] = make_brick(blocks, bricks_[i], floats_.get() + i * TensorBrick::stored_floats);
    });
    if (last < bricks_.size()) give_back(bricks_[last].x() * TensorBrick::cells);
    first = last;
  }
}

/// Memory for `bricks` bricks, filled with zeros. It uses large pages where the system has them, because rays visit
/// bricks that are far apart in memory.
TensorField::Floats TensorField::allocate(std::size_t bricks) {
  const std::size_t bytes = bricks * TensorBrick::stored_floats * sizeof(float);
  constexpr std::size_t alignment = 4096;
  return {static_cast<float*>(map_pages(bytes, alignment)), Release{bytes}};
}

void TensorField::Release::operator()(float* floats) const { unmap_pages(floats, bytes); }

std::vector<Eigen::Vector3d> TensorField::corners() const { return corners_of(index_bounds_, to_world_); }

Eigen::AlignedBox3d TensorField::world_box() const { return box_of(corners()); }

double TensorField::greatest_norm() const {
  double greatest = 0;
  for (std::size_t i = 0; i < brick_count(); ++i) {
    make_room();
    const TensorBrick brick = stored(i);
    for (int voxel = 0; voxel < TensorBrick::voxels; ++voxel)
      greatest = std::max(greatest, brick.tensor(voxel).squaredNorm());
  }
  return std::sqrt(greatest);
}

std::size_t TensorField::memory_bytes() const {
  return brick_count() * ((TensorBrick::stored_floats + 1) * sizeof(float) + sizeof(Eigen::Vector3i)) +
         index_.memory_bytes();
}

}  // namespace tensorray
