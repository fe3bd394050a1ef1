#include "volumes/tensor_field.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <tuple>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

constexpr int cells = TensorField::brick_cells;
constexpr int width = TensorField::brick_width;
constexpr int voxel_floats = TensorField::voxel_floats;
static_assert(cells == TensorBlock::size, "a brick holds a block and the near faces of its neighbours");

constexpr int voxel_offset(int x, int y, int z) { return ((x * width + y) * width + z) * voxel_floats; }

const std::array<float, TensorField::brick_floats> zero_brick{};

struct CoordinateLess {
  bool operator()(const Eigen::Vector3i& a, const Eigen::Vector3i& b) const {
    return std::make_tuple(a.x(), a.y(), a.z()) < std::make_tuple(b.x(), b.y(), b.z());
  }
};

/// The bricks that hold an active voxel of a block, as a cell's corner: its own, and where a voxel lies on a near face
/// of the block the one before it, whose apron shares that voxel.
void add_bricks_of(const TensorBlock& block, std::set<Eigen::Vector3i, CoordinateLess>& bricks) {
  std::bitset<8> touched;
  for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
    if (!block.active[offset]) continue;
    const Eigen::Vector3i p = TensorBlock::position(offset);
    const int faces = (p.x() == 0) | (p.y() == 0) << 1 | (p.z() == 0) << 2;
    for (int before = 0; before < 8; ++before)
      if ((before & faces) == before) touched.set(before);
  }
  for (int before = 0; before < 8; ++before)
    if (touched[before])
      bricks.insert(block.origin / cells - Eigen::Vector3i(before & 1, before >> 1 & 1, before >> 2 & 1));
}

/// Copies the voxels that a block and a brick share.
void copy_shared_voxels(const TensorBlock& block, const Eigen::Vector3i& brick, float* floats) {
  const Eigen::Vector3i shift = block.origin - brick * cells;  // Of the block in the brick: 0 or 8 along each axis.
  const Eigen::Vector3i last = (Eigen::Vector3i::Constant(width) - shift).cwiseMin(TensorBlock::size);
  for (int x = 0; x < last.x(); ++x)
    for (int y = 0; y < last.y(); ++y)
      for (int z = 0; z < last.z(); ++z)
        Eigen::Map<Eigen::Matrix3f>(floats + voxel_offset(x + shift.x(), y + shift.y(), z + shift.z())) =
            block.values[TensorBlock::offset(x, y, z)];
}

std::vector<std::pair<Eigen::Vector3i, const TensorBlock*>> sorted_blocks(const TensorGrid& grid) {
  std::vector<std::pair<Eigen::Vector3i, const TensorBlock*>> blocks;
  for (const TensorBlock& block : grid.blocks) blocks.emplace_back(block.origin, &block);
  std::sort(blocks.begin(), blocks.end(), [](auto& a, auto& b) { return CoordinateLess()(a.first, b.first); });
  return blocks;
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

TensorField::TensorField(const TensorGrid& grid) : to_world_(grid.to_world), to_index_(grid.to_world.inverse()) {
  const Eigen::AlignedBox3i active = grid.active_box();
  if (active.isEmpty()) throw std::invalid_argument("the tensor field has no active voxel");
  if (!to_world_.matrix().allFinite() || !to_index_.matrix().allFinite())
    throw std::invalid_argument("the tensor field's transform cannot be inverted");
  index_bounds_ = extent_of(active);
  voxels_ = Eigen::AlignedBox3d(active.min().cast<double>(), active.max().cast<double>());

  std::set<Eigen::Vector3i, CoordinateLess> found;
  for (const TensorBlock& block : grid.blocks) add_bricks_of(block, found);
  const std::vector<Eigen::Vector3i> coordinates(found.begin(), found.end());
  make_table(coordinates);

  const auto blocks = sorted_blocks(grid);
  bricks_.resize(coordinates.size() * brick_floats);
  tbb::parallel_for(std::size_t{0}, coordinates.size(), [&](std::size_t i) {
    float* floats = bricks_.data() + i * brick_floats;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i origin =
          cells * (coordinates[i] + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2 & 1));
      const auto block = std::lower_bound(blocks.begin(), blocks.end(), origin,
                                          [](auto& a, auto& b) { return CoordinateLess()(a.first, b); });
      if (block != blocks.end() && block->first == origin) copy_shared_voxels(*block->second, coordinates[i], floats);
    }
  });
}

void TensorField::make_table(const std::vector<Eigen::Vector3i>& bricks) {
  std::size_t size = 16;
  while (size < 2 * bricks.size()) size *= 2;
  slots_.assign(size, Slot{Eigen::Vector3i::Zero(), empty_slot});
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    std::size_t slot = home_slot(bricks[i]);
    while (slots_[slot].index != empty_slot) slot = (slot + 1) & (size - 1);
    slots_[slot] = {bricks[i], static_cast<std::uint32_t>(i)};
  }
}

std::size_t TensorField::home_slot(const Eigen::Vector3i& brick) const {
  const auto part = [](int value, std::uint64_t factor) { return static_cast<std::uint32_t>(value) * factor; };
  std::uint64_t hash = part(brick.x(), 0x9e3779b97f4a7c15u) ^ part(brick.y(), 0xc2b2ae3d27d4eb4fu) ^
                       part(brick.z(), 0x165667b19e3779f9u);
  hash ^= hash >> 32;
  return static_cast<std::size_t>(hash) & (slots_.size() - 1);
}

const float* TensorField::brick(const Eigen::Vector3i& brick) const {
  for (std::size_t slot = home_slot(brick);; slot = (slot + 1) & (slots_.size() - 1)) {
    if (slots_[slot].index == empty_slot) return zero_brick.data();
    if (slots_[slot].brick == brick) return bricks_.data() + std::size_t{slots_[slot].index} * brick_floats;
  }
}

std::vector<Eigen::Vector3d> TensorField::corners() const {
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i)
    corners.push_back(to_world_ * index_bounds_.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)));
  return corners;
}

double TensorField::greatest_norm() const {
  double greatest = 0;
  for (std::size_t i = 0; i < bricks_.size(); i += voxel_floats)
    greatest = std::max(greatest, Eigen::Map<const Eigen::Matrix3f>(&bricks_[i]).cast<double>().squaredNorm());
  return std::sqrt(greatest);
}

TensorField TensorField::scaled(double factor) && {
  for (float& value : bricks_) value = static_cast<float>(value * factor);
  return std::move(*this);
}

std::size_t TensorField::memory_bytes() const { return bricks_.size() * sizeof(float) + slots_.size() * sizeof(Slot); }

const float* TensorSampler::locate(const Eigen::Vector3d& world, Eigen::Vector3d& fraction) {
  const Eigen::AlignedBox3d& voxels = field_->voxels();
  Eigen::Vector3d index = field_->to_index() * world;
  for (int axis = 0; axis < 3; ++axis)  // In this order NaN goes to the first voxel.
    index[axis] = std::min(std::max(voxels.min()[axis], index[axis]), voxels.max()[axis]);
  Eigen::Vector3i cell = index.array().floor().cast<int>();
  fraction = index - cell.cast<double>();
  const Eigen::Vector3i brick(cell.x() >> 3, cell.y() >> 3, cell.z() >> 3);
  if (floats_ == nullptr || brick != brick_) {
    brick_ = brick;
    floats_ = field_->brick(brick);
  }
  cell -= cells * brick;
  return floats_ + voxel_offset(cell.x(), cell.y(), cell.z());
}

namespace {

constexpr int step_x = voxel_offset(1, 0, 0), step_y = voxel_offset(0, 1, 0), step_z = voxel_offset(0, 0, 1);

/// Eight components fill vector registers, the ninth goes alone.
using Eight = Eigen::Array<double, 8, 1>;

Eight first_eight(const float* voxel) { return Eigen::Map<const Eigen::Array<float, 8, 1>>(voxel).cast<double>(); }
double ninth(const float* voxel) { return voxel[8]; }

Eigen::Matrix3d to_matrix(const Eight& eight, double last) {
  Eigen::Matrix3d result;
  Eigen::Map<Eight>(result.data()) = eight;
  result(2, 2) = last;
  return result;
}

/// A value, and its slopes along the axes of index space.
template <class Value>
struct Slopes {
  Value value, x, y, z;
};

/// Trilinear interpolation in a cell: along z, then y, then x. `load` gives the components of a voxel.
template <class Value, class Load>
Slopes<Value> interpolate(const float* voxel, const Eigen::Vector3d& f, Load load) {
  Value value[2], slope_y[2], slope_z[2];
  for (int x = 0; x < 2; ++x) {
    const float* const face = voxel + x * step_x;
    const Value near = load(face), far = load(face + step_y);
    const Value near_z = load(face + step_z) - near, far_z = load(face + step_y + step_z) - far;
    const Value near_value = near + f.z() * near_z;
    slope_y[x] = far + f.z() * far_z - near_value;
    slope_z[x] = near_z + f.y() * (far_z - near_z);
    value[x] = near_value + f.y() * slope_y[x];
  }
  const Value slope_x = value[1] - value[0];
  return {value[0] + f.x() * slope_x, slope_x, slope_y[0] + f.x() * (slope_y[1] - slope_y[0]),
          slope_z[0] + f.x() * (slope_z[1] - slope_z[0])};
}

}  // namespace

Eigen::Matrix3d TensorSampler::at(const Eigen::Vector3d& world) {
  ++samples_;
  Eigen::Vector3d f;
  const float* voxel = locate(world, f);
  const double wx[2] = {1 - f.x(), f.x()}, wy[2] = {1 - f.y(), f.y()}, wz[2] = {1 - f.z(), f.z()};
  Eight eight = Eight::Zero();
  double last = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner >> 2, y = corner >> 1 & 1, z = corner & 1;
    const float* value = voxel + x * step_x + y * step_y + z * step_z;
    const double weight = wx[x] * wy[y] * wz[z];
    eight += weight * first_eight(value);
    last += weight * ninth(value);
  }
  return to_matrix(eight, last);
}

Eigen::Matrix3d TensorSampler::at(const Eigen::Vector3d& world, const Eigen::Matrix<double, 3, 2>& along,
                                  std::array<Eigen::Matrix3d, 2>& derivatives) {
  ++samples_;
  Eigen::Vector3d f;
  const float* voxel = locate(world, f);
  const Slopes<Eight> eight = interpolate<Eight>(voxel, f, first_eight);
  const Slopes<double> last = interpolate<double>(voxel, f, ninth);
  Eigen::Matrix<double, 3, 2> by_index = field_->to_index().linear() * along;
  // An axis of a single voxel has the same tensor across it.
  for (int axis = 0; axis < 3; ++axis)
    if (field_->voxels().sizes()[axis] == 0) by_index.row(axis).setZero();
  for (int i = 0; i < 2; ++i) {
    const double x = by_index(0, i), y = by_index(1, i), z = by_index(2, i);
    derivatives[i] = to_matrix(x * eight.x + y * eight.y + z * eight.z, x * last.x + y * last.y + z * last.z);
  }
  return to_matrix(eight.value, last.value);
}

}  // namespace tensorray
