#include "volumes/bricks/tensor_field.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "base/geometry/box.h"
#include "volumes/bricks/brick_making.h"
#include "volumes/bricks/coefficients.h"
#include "volumes/bricks/cubic_brick.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

struct alignas(64) ZeroBrick {
  float floats[CubicBrick::stored_floats(TensorBrick::general)] = {};
};
constexpr ZeroBrick zero_brick;

/// Number of blocks that are placed before all threads wait; enough to keep them busy.
constexpr std::size_t part_size = 4096;

/// Number of blocks that a thread places in a row. Neighbours along z share bricks.
constexpr std::size_t grain = 16;

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

const float* const TensorField::zeros = zero_brick.floats;

Eigen::Matrix3d TensorBrick::tensor(int voxel) const {
  Eigen::Matrix3d T;
  for (int i = 0; i < general; ++i)
    T.data()[i] = double{bending[bending_offset(components, voxel) + stored_component(components, i)]};
  T(2, 2) = trailing[voxel];
  T(0, 0) += T(2, 2);
  T(1, 1) += T(2, 2);
  return T;
}

TensorField::TensorField(const TensorGrid& grid, const Interpolant& interpolant)
    : TensorField(view_of(grid), interpolant) {}

TensorField::TensorField(const BlockSource& source, const Interpolant& interpolant)
    : interpolant_(interpolant), to_world_(source.to_world), to_index_(source.to_world.inverse()) {
  const Eigen::AlignedBox3i active = active_box(source.shapes);
  if (active.isEmpty()) throw std::invalid_argument("the tensor field has no active voxel");
  if (!to_world_.matrix().allFinite() || !to_index_.matrix().allFinite())
    throw std::invalid_argument("the tensor field's transform cannot be inverted");
  index_bounds_ = extent_of(active);
  voxels_ = Eigen::AlignedBox3d(active.min().cast<double>(), active.max().cast<double>());

  const BlockTable table(source.shapes);
  const double norm = is_cubic() ? make_cubic_bricks(table, active, source) : make_linear_bricks(table, active, source);
  greatest_norm_ = std::sqrt(norm);
}

/// @return the greatest squared norm of a voxel.
double TensorField::make_linear_bricks(const BlockTable& table, const Eigen::AlignedBox3i& active,
                                       const BlockSource& source) {
  bricks_ = active_bricks(table, bricks_of(active));
  bricks_.shrink_to_fit();
  index_ = BrickIndex(bricks_);
  std::vector<BlockShare> shares(table.shapes.size());
  place_blocks(source, [&](std::size_t i, const TensorBlock& block) {
    std::array<float*, bricks_of_block> bricks{};
    for (int bits = 0; bits < bricks_of_block; ++bits)
      if (const std::uint32_t brick = index_.find(table.places[i] - corner(bits)); brick != BrickIndex::missing)
        bricks[static_cast<std::size_t>(bits)] = floats_of(brick);
    const std::optional<BlockShare> share = place_block(block, components_, bricks);
    if (share) shares[i] = *share;
    return share.has_value();
  });
  std::vector<float> strongest(bricks_.size());
  tbb::parallel_for(std::size_t{0}, bricks_.size(), [&](std::size_t i) {
    strongest[i] = strongest_deviator(table, shares, bricks_[i], brick_at(floats_of(i), 0));
  });
  index_.set_values(strongest);
  double norm = 0;
  for (const BlockShare& share : shares) norm = std::max(norm, share.norm);
  return norm;
}

/// The same. Voxels become coefficients in place.
double TensorField::make_cubic_bricks(const BlockTable& table, const Eigen::AlignedBox3i& active,
                                      const BlockSource& source) {
  CoefficientBricks coefficients = coefficient_bricks(table, active, interpolant_.border);
  bricks_ = coefficients.places;
  std::vector<double> norms(table.shapes.size());
  place_blocks(source, [&](std::size_t i, const TensorBlock& block) {
    const auto norm = place_values(block, components_, floats_of(coefficients.index.find(table.places[i])));
    if (norm) norms[i] = *norm;
    return norm.has_value();
  });
  const CoefficientMemory memory{floats_.get(), brick_floats_, components_};
  continue_values(coefficients, interpolant_.border, memory);
  const std::vector<float> strongest = make_coefficients(coefficients, active, interpolant_.border, memory);
  keep_bricks(coefficients.count);
  index_.set_values(strongest);
  return *std::max_element(norms.begin(), norms.end());
}

/// Fills the bricks. They store symmetric tensors until the first block comes that has others. Its part is then placed
/// again.
void TensorField::place_blocks(const BlockSource& source, const Place& place) {
  allocate(TensorBrick::symmetric);
  std::atomic<bool> fits{true};
  const auto place_part = [&](const tbb::blocked_range<std::size_t>& range) {
    TensorBlock block;
    for (std::size_t i = range.begin(); i < range.end() && fits; ++i) {
      make_room();
      read_block(source, i, block);
      if (!place(i, block)) fits = false;
    }
  };
  const std::size_t count = source.shapes.size();
  for (std::size_t first = 0; first < count; first += part_size) {
    const tbb::blocked_range<std::size_t> part(first, std::min(first + part_size, count), grain);
    tbb::parallel_for(part, place_part);
    if (!fits) {
      widen(first > 0);
      fits = true;
      tbb::parallel_for(part, place_part);
    }
  }
  expect_first_writes(floats_.get(), std::get_deleter<Release>(floats_)->bytes, false);
}

/// Replaces the bricks by those of tensors of any kind. `keep`: with the tensors that they hold.
void TensorField::widen(bool keep) {
  const Floats narrow = std::move(floats_);
  const std::size_t stored_floats = brick_floats_;
  allocate(TensorBrick::general);
  if (!keep) return;
  tbb::parallel_for(std::size_t{0}, bricks_.size(), [&](std::size_t i) {
    make_room();
    (is_cubic() ? widen_coefficients : widen_brick)(narrow.get() + i * stored_floats, floats_of(i));
  });
}

/// Memory for all bricks, filled with zeros. It uses large pages where the system has them, because rays visit bricks
/// that are far apart in memory.
void TensorField::allocate(int components) {
  components_ = components;
  brick_floats_ = static_cast<std::size_t>(is_cubic() ? CubicBrick::stored_floats(components)
                                                      : TensorBrick::stored_floats(components));
  trailing_offset_ = static_cast<std::size_t>(is_cubic() ? CubicBrick::trailing_offset(components)
                                                         : TensorBrick::trailing_offset(components));
  const std::size_t bytes = bricks_.size() * brick_floats_ * sizeof(float);
  constexpr std::size_t alignment = 4096;
  floats_ = {static_cast<float*>(map_pages(bytes, alignment)), Release{bytes}};
  expect_first_writes(floats_.get(), bytes, true);
}

/// Frees all bricks but the first ones.
void TensorField::keep_bricks(std::size_t count) {
  bricks_.resize(count);
  bricks_.shrink_to_fit();
  index_ = BrickIndex(bricks_);
  Release& release = *std::get_deleter<Release>(floats_);
  release.bytes = shrink_pages(floats_.get(), release.bytes, count * brick_floats_ * sizeof(float));
}

void TensorField::Release::operator()(float* floats) const { unmap_pages(floats, bytes); }

std::vector<Eigen::Vector3d> TensorField::corners() const { return corners_of(index_bounds_, to_world_); }

Eigen::AlignedBox3d TensorField::world_box() const { return box_of(corners()); }

std::size_t TensorField::memory_bytes() const {
  return brick_count() * (brick_floats_ * sizeof(float) + sizeof(Eigen::Vector3i)) + index_.memory_bytes();
}

}  // namespace tensorray
