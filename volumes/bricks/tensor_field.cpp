#include "volumes/bricks/tensor_field.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "base/geometry/box.h"
#include "volumes/bricks/brick_layout.h"
#include "volumes/bricks/coefficients.h"

namespace tensorray {
namespace {

struct alignas(64) ZeroBrick {
  float floats[CubicBrick::stored_floats(TensorBrick::general)] = {};
};
constexpr ZeroBrick zero_brick;

Eigen::AlignedBox3d extent_of(const Eigen::AlignedBox3i& voxels) {
  Eigen::AlignedBox3d extent(voxels.min().cast<double>(), voxels.max().cast<double>());
  for (int axis = 0; axis < 3; ++axis)
    if (voxels.sizes()[axis] == 0) {
      extent.min()[axis] -= 0.5;
      extent.max()[axis] += 0.5;
    }
  return extent;
}

constexpr double on_voxel = 1e-5;  // A surface that is so near to a voxel's centre, in voxels, ends there.

/// The bounds of a surface in index space; empty: there is none.
Eigen::AlignedBox3d index_box(const TriangleMesh& surface, const Eigen::Affine3d& to_index) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : surface.vertices) box.extend(to_index * vertex);
  return box;
}

/// The voxels of the extent, where a body has these bounds (TensorField::index_bounds).
Eigen::AlignedBox3i voxels_of(const Eigen::AlignedBox3i& active, const Eigen::AlignedBox3d& body) {
  Eigen::AlignedBox3i voxels = active;
  for (int axis = 0; axis < 3 && !body.isEmpty(); ++axis) {
    const double low = active.min()[axis], high = active.max()[axis];
    const double from = body.min()[axis] + on_voxel, to = body.max()[axis] - on_voxel;
    if (low == high && from > low - 0.5 && to < high + 0.5) continue;
    voxels.min()[axis] = static_cast<int>(std::clamp(std::floor(from), low - TensorField::most_beyond, low));
    voxels.max()[axis] = static_cast<int>(std::clamp(std::ceil(to), high, high + TensorField::most_beyond));
  }
  return voxels;
}

/// A linear field without a surface is zero beside active voxels.
Interpolant used_interpolant(Interpolant interpolant, bool has_surface) {
  if (interpolant.between == Interpolation::linear && !has_surface) interpolant.border = Border::fade;
  return interpolant;
}

/// Reads each block once, on all threads, and places its values. @param norms  Get the greatest squared norms.
/// @return false if a block is not symmetric, as those of `blocks` must be.
bool place_blocks(const BlockSource& source, const BlockTable& table, const CoefficientBricks& bricks,
                  const BrickMemory& blocks, std::vector<double>& norms) {
  constexpr std::size_t grain = 16;  // Number of blocks that a thread places in a row.
  std::atomic<bool> fits{true};
  const tbb::blocked_range<std::size_t> all(0, source.shapes.size(), grain);
  tbb::parallel_for(all, [&](const tbb::blocked_range<std::size_t>& range) {
    TensorBlock block;
    for (std::size_t i = range.begin(); i < range.end() && fits; ++i) {
      read_block(source, i, block);
      const std::uint32_t at = bricks.index.find(table.places[i]);
      if (at == BrickIndex::missing) continue;  // It has no active voxel.
      if (const auto norm = place_values(block, blocks.components, blocks.brick(at)))
        norms[i] = *norm;
      else
        fits = false;
    }
  });
  return fits;
}

}  // namespace

const float* const TensorField::zeros = zero_brick.floats;

Eigen::Matrix3d TensorBrick::tensor(int voxel) const {
  Eigen::Matrix3d T;
  for (int i = 0; i < general; ++i)
    T.data()[i] = double{bending[LinearBrick::bending_offset(components, voxel) + stored_component(components, i)]};
  T(2, 2) = trailing[voxel];
  T(0, 0) += T(2, 2);
  T(1, 1) += T(2, 2);
  return T;
}

TensorField::TensorField(const TensorGrid& grid, const Interpolant& interpolant)
    : TensorField(view_of(grid), interpolant) {}

TensorField::TensorField(const BlockSource& source, const Interpolant& interpolant)
    : interpolant_(interpolant),
      to_world_(source.to_world),
      to_index_(source.to_world.inverse()),
      surface_(std::make_shared<const TriangleMesh>(source.surface)) {
  const Eigen::AlignedBox3i active = active_box(source.shapes);
  if (active.isEmpty()) throw std::invalid_argument("the tensor field has no active voxel");
  if (!to_world_.matrix().allFinite() || !to_index_.matrix().allFinite())
    throw std::invalid_argument("the tensor field's transform cannot be inverted");
  const Eigen::AlignedBox3i voxels = voxels_of(active, index_box(source.surface, to_index_));
  const Interpolant used = used_interpolant(interpolant, !source.surface.triangles.empty());
  index_bounds_ = extent_of(voxels);
  voxels_ = Eigen::AlignedBox3d(voxels.min().cast<double>(), voxels.max().cast<double>());

  // Blocks of voxels become those of coefficients, from which bricks are made.
  const BlockTable table(source.shapes);
  const CoefficientBricks bricks = coefficient_bricks(table, voxels, used);
  std::vector<double> norms(table.shapes.size());
  BrickMemory blocks;
  for (const int components : {TensorBrick::symmetric, TensorBrick::general}) {  // Any tensors fit the second time.
    blocks = memory_ = {};
    memory_ = brick_memory(bricks, interpolant.between, components);
    blocks = blocks_within(memory_, bricks);
    if (place_blocks(source, table, bricks, blocks, norms)) break;
  }
  const Coefficients coefficients{bricks, voxels, used, blocks};
  continue_values(coefficients);
  const std::vector<float> strongest = make_coefficients(coefficients, memory_);
  keep_bricks(memory_, bricks.count);
  max_norm_ = std::sqrt(*std::max_element(norms.begin(), norms.end()));
  bricks_.assign(bricks.places.begin(), bricks.places.begin() + static_cast<std::ptrdiff_t>(bricks.count));
  index_ = BrickIndex(bricks_);
  index_.set_values(strongest);
  set_trailing_offset();
}

TensorField::TensorField(FieldParts parts)
    : interpolant_(parts.interpolant),
      to_world_(parts.to_world),
      to_index_(parts.to_world.inverse()),
      index_bounds_(extent_of(parts.voxels)),
      voxels_(parts.voxels.cast<double>()),
      bricks_(std::move(parts.bricks)),
      memory_(std::move(parts.memory)),
      surface_(std::make_shared<const TriangleMesh>(std::move(parts.surface))),
      max_norm_(parts.max_norm),
      index_(bricks_) {
  index_.set_values(parts.strongest);
  set_trailing_offset();
}

void TensorField::set_trailing_offset() {
  trailing_offset_ = static_cast<std::size_t>(is_cubic() ? CubicBrick::trailing_offset(memory_.components)
                                                         : LinearBrick::trailing_offset(memory_.components));
}

void TensorField::keep_with_bricks(std::shared_ptr<const void> other) {
  float* const floats = memory_.floats.get();
  memory_.floats = {floats, [bricks = memory_.floats, other = std::move(other)](float*) {}};
}

std::vector<Eigen::Vector3d> TensorField::corners() const { return corners_of(index_bounds_, to_world_); }

double TensorField::surface_beyond() const {
  const Eigen::AlignedBox3d body = index_box(surface(), to_index_);
  if (body.isEmpty()) return 0;
  const double beyond =
      std::max((index_bounds_.min() - body.min()).maxCoeff(), (body.max() - index_bounds_.max()).maxCoeff());
  return beyond > on_voxel ? beyond : 0;
}

Eigen::AlignedBox3d TensorField::world_box() const { return box_of(corners()); }

std::size_t TensorField::memory_bytes() const {
  return brick_count() * (memory_.stride * sizeof(float) + sizeof(Eigen::Vector3i)) + index_.memory_bytes();
}

}  // namespace tensorray
