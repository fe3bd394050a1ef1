#include "volumes/tensor_field.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <new>
#include <stdexcept>
#include <tuple>

#include <sys/mman.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

namespace tensorray {
namespace {

constexpr int cells = TensorBrick::cells;
constexpr int width = TensorBrick::width;
static_assert(cells == TensorBlock::size, "a brick holds a block and the near faces of its neighbours");

constexpr int trailing_offset = TensorBrick::trailing_offset;
constexpr int used_floats = trailing_offset + TensorBrick::voxels;
constexpr int brick_floats = (used_floats + 15) / 16 * 16;  // Bricks begin on cache lines.

struct alignas(64) ZeroBrick {
  float floats[brick_floats] = {};
};
const ZeroBrick zero_brick;

TensorBrick brick_at(const float* floats, float strongest) { return {floats, floats + trailing_offset, strongest}; }

/// Memory for `count` floats, zero, from large pages where the system has them: bricks are visited far apart.
float* allocate(std::size_t count) {
  void* const memory = mmap(nullptr, count * sizeof(float), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
  madvise(memory, count * sizeof(float), MADV_HUGEPAGE);
#endif
  return static_cast<float*>(memory);
}

struct CoordinateLess {
  bool operator()(const Eigen::Vector3i& a, const Eigen::Vector3i& b) const {
    return std::make_tuple(a.x(), a.y(), a.z()) < std::make_tuple(b.x(), b.y(), b.z());
  }
};

/// The blocks before this one, as bits of x, y and z, whose aprons share an active voxel of it.
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

/// The bricks of `extent` that hold an active voxel as a cell's corner, in order: each block's own, and where a voxel
/// lies on a near face of it the one before it, whose apron shares that voxel.
std::vector<Eigen::Vector3i> active_bricks(const TensorGrid& grid, const Eigen::AlignedBox3i& extent) {
  std::vector<Eigen::Vector3i> bricks;
  for (const TensorBlock& block : grid.blocks) {
    const std::bitset<8> touched = shared_faces(block);
    for (int before = 0; before < 8; ++before) {
      const Eigen::Vector3i brick =
          block.origin / cells - Eigen::Vector3i(before & 1, before >> 1 & 1, before >> 2 & 1);
      if (touched[before] && extent.contains(brick)) bricks.push_back(brick);
    }
  }
  tbb::parallel_sort(bricks.begin(), bricks.end(), CoordinateLess());
  bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
  return bricks;
}

/// The bricks of the cells between the voxels of a box (an axis of a single voxel has one cell).
Eigen::AlignedBox3i bricks_of(const Eigen::AlignedBox3i& voxels) {
  const auto brick_of = [](int cell) { return cell >> 3; };
  const Eigen::Vector3i last = (voxels.max().array() - 1).matrix().cwiseMax(voxels.min());
  return {voxels.min().unaryExpr(brick_of), last.unaryExpr(brick_of)};
}

void store(const Eigen::Matrix3f& T, int voxel, float* brick) {
  Eigen::Map<Eigen::Matrix<float, 8, 1>> bending(brick + voxel * TensorBrick::bending_floats);
  bending = Eigen::Map<const Eigen::Matrix<float, 8, 1>>(T.data());
  bending[0] -= T(2, 2);
  bending[4] -= T(2, 2);
  brick[trailing_offset + voxel] = T(2, 2);
}

/// Copies the voxels that a block and a brick share.
void copy_shared_voxels(const TensorBlock& block, const Eigen::Vector3i& brick, float* floats) {
  const Eigen::Vector3i shift = block.origin - brick * cells;  // Of the block in the brick: 0 or 8 along each axis.
  const Eigen::Vector3i last = (Eigen::Vector3i::Constant(width) - shift).cwiseMin(TensorBlock::size);
  for (int x = 0; x < last.x(); ++x)
    for (int y = 0; y < last.y(); ++y)
      for (int z = 0; z < last.z(); ++z)
        store(block.values[TensorBlock::offset(x, y, z)],
              TensorBrick::voxel(x + shift.x(), y + shift.y(), z + shift.z()), floats);
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

/// The squared Frobenius norm of the deviator of T, from the eight floats of T − T₂₂ I.
double squared_deviator(const float* bending) {
  double squares = 0;
  for (int i = 0; i < TensorBrick::bending_floats; ++i) squares += double{bending[i]} * bending[i];
  const double trace = double{bending[0]} + bending[4];
  return std::max(0.0, squares - trace * trace / 3);
}

float strongest_deviator(const float* brick) {
  double greatest = 0;
  for (int voxel = 0; voxel < TensorBrick::voxels; ++voxel)
    greatest = std::max(greatest, squared_deviator(brick + voxel * TensorBrick::bending_floats));
  // Rounded up: interpolation between voxels may round to a little more than any of them.
  return static_cast<float>(std::sqrt(greatest) * (1 + 1e-5));
}

}  // namespace

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
  const Eigen::AlignedBox3i active = grid.active_box();
  if (active.isEmpty()) throw std::invalid_argument("the tensor field has no active voxel");
  if (!to_world_.matrix().allFinite() || !to_index_.matrix().allFinite())
    throw std::invalid_argument("the tensor field's transform cannot be inverted");
  index_bounds_ = extent_of(active);
  voxels_ = Eigen::AlignedBox3d(active.min().cast<double>(), active.max().cast<double>());

  const std::vector<Eigen::Vector3i> coordinates = active_bricks(grid, bricks_of(active));
  make_table(coordinates);

  const auto blocks = sorted_blocks(grid);
  floats_ = {allocate(coordinates.size() * brick_floats), {coordinates.size() * brick_floats * sizeof(float)}};
  strongest_.resize(coordinates.size());
  tbb::parallel_for(std::size_t{0}, coordinates.size(), [&](std::size_t i) {
    float* floats = floats_.get() + i * brick_floats;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i origin =
          cells * (coordinates[i] + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2 & 1));
      const auto block = std::lower_bound(blocks.begin(), blocks.end(), origin,
                                          [](auto& a, auto& b) { return CoordinateLess()(a.first, b); });
      if (block != blocks.end() && block->first == origin) copy_shared_voxels(*block->second, coordinates[i], floats);
    }
    strongest_[i] = strongest_deviator(floats);
  });
}

void TensorField::Release::operator()(float* floats) const { munmap(floats, bytes); }

void TensorField::make_table(const std::vector<Eigen::Vector3i>& bricks) {
  std::size_t size = 16;
  while (size < 2 * bricks.size()) size *= 2;
  slots_.assign(size, Slot{Eigen::Vector3i::Zero(), missing});
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    std::size_t slot = home_slot(bricks[i]);
    while (slots_[slot].index != missing) slot = (slot + 1) & (size - 1);
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

std::uint32_t TensorField::find(const Eigen::Vector3i& brick) const {
  for (std::size_t slot = home_slot(brick);; slot = (slot + 1) & (slots_.size() - 1))
    if (slots_[slot].index == missing || slots_[slot].brick == brick) return slots_[slot].index;
}

TensorBrick TensorField::brick(const Eigen::Vector3i& brick) const {
  const std::uint32_t index = find(brick);
  if (index == missing) return brick_at(zero_brick.floats, 0);
  return brick_at(floats_.get() + std::size_t{index} * brick_floats, strongest_[index]);
}

std::vector<Eigen::Vector3d> TensorField::corners() const {
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i)
    corners.push_back(to_world_ * index_bounds_.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)));
  return corners;
}

double TensorField::greatest_norm() const {
  double greatest = 0;
  for (std::size_t i = 0; i < brick_count(); ++i) {
    const TensorBrick brick = brick_at(floats_.get() + i * brick_floats, 0);
    for (int voxel = 0; voxel < TensorBrick::voxels; ++voxel)
      greatest = std::max(greatest, brick.tensor(voxel).squaredNorm());
  }
  return std::sqrt(greatest);
}

TensorField TensorField::copy() const {
  TensorField result;
  result.to_world_ = to_world_;
  result.to_index_ = to_index_;
  result.index_bounds_ = index_bounds_;
  result.voxels_ = voxels_;
  result.strongest_ = strongest_;
  result.slots_ = slots_;
  result.floats_ = {allocate(brick_count() * brick_floats), floats_.get_deleter()};
  std::copy_n(floats_.get(), brick_count() * brick_floats, result.floats_.get());
  return result;
}

TensorField TensorField::scaled(double factor) && {
  tbb::parallel_for(std::size_t{0}, brick_count(), [&](std::size_t i) {
    float* const floats = floats_.get() + i * brick_floats;
    for (int j = 0; j < used_floats; ++j) floats[j] = static_cast<float>(floats[j] * factor);
    strongest_[i] = strongest_deviator(floats);
  });
  return std::move(*this);
}

std::size_t TensorField::memory_bytes() const {
  return brick_count() * (brick_floats + 1) * sizeof(float) + slots_.size() * sizeof(Slot);
}

}  // namespace tensorray
