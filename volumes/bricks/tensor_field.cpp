#include "volumes/bricks/tensor_field.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "base/geometry/box.h"
#include "volumes/bricks/brick_layout.h"
#include "volumes/bricks/coefficients.h"
#include "volumes/bricks/finer_bricks.h"

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

/// The blocks of a level.
struct BlocksOfLevel {
  const std::vector<BlockShape>& shapes;
  const std::function<void(std::size_t i, TensorBlock& block)>& fill;
};

BlocksOfLevel blocks_of(const BlockSource& source, std::size_t level) {
  if (level == 0) return {source.shapes, source.fill};
  return {source.finer[level - 1].shapes, source.finer[level - 1].fill};
}

/// What the bricks of a level are made of.
struct LevelPlan {
  BlocksOfLevel blocks;
  BlockTable table;
  Eigen::AlignedBox3i extent;
};

/// Reads each block once, on all threads, and places its values; of a finer level, what the coarser spline leaves.
/// @param norm  Becomes the greatest squared norm, if it is greater.
/// @return false if a block is not symmetric, as those of `field.blocks` must be.
bool place_blocks(const LevelPlan& level, const Coefficients& field, double& norm) {
  constexpr std::size_t grain = 16;  // Number of blocks that a thread places in a row.
  std::atomic<bool> fits{true};
  const std::size_t count = field.bricks.places.size();
  std::vector<double> norms(count);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain), [&](const auto& range) {
    TensorBlock block;
    for (std::size_t i = range.begin(); i < range.end() && fits; ++i) {
      float* const values = field.blocks.brick(i);
      const std::uint32_t at = level.table.index.find(field.bricks.places[i]);
      if (at != BrickIndex::missing) {
        read_block(level.blocks.shapes[at], level.blocks.fill, at, block);
        if (const auto square = place_values(block, field.blocks.components, values))
          norms[i] = *square;
        else
          fits = false;
      }
      if (field.coarser) subtract_coarser(field, i, values);
    }
  });
  if (count > 0) norm = std::max(norm, *std::max_element(norms.begin(), norms.end()));
  return fits;
}

void check_levels(const BlockSource& source, const Eigen::AlignedBox3i& voxels, const Interpolant& interpolant) {
  if (source.finer.empty()) return;
  if (interpolant.between != Interpolation::cubic)
    throw std::invalid_argument("the tensor field has several levels, which need \"interpolation\": \"cubic\"");
  if (source.finer.size() >= max_levels) throw std::invalid_argument("the tensor field has more than 4 levels");
  constexpr int farthest = 1 << 27;  // Indices of the finest level are integers.
  if (voxels.min().minCoeff() < -farthest || voxels.max().maxCoeff() > farthest)
    throw std::invalid_argument("the tensor field has several levels and voxels too far from index 0");
}

/// The levels until one that is empty.
std::vector<LevelPlan> plans_of(const BlockSource& source, const Eigen::AlignedBox3i& voxels) {
  std::vector<LevelPlan> plans;
  for (std::size_t level = 0; level <= source.finer.size(); ++level) {
    const BlocksOfLevel blocks = blocks_of(source, level);
    if (blocks.shapes.empty()) break;
    plans.push_back({blocks, BlockTable(blocks.shapes), level == 0 ? voxels : finer_extent(plans.back().extent)});
  }
  return plans;
}

/// The bricks of each level, until one that refines nothing.
std::vector<CoefficientBricks> bricks_of(const std::vector<LevelPlan>& plans, const Interpolant& used) {
  std::vector<CoefficientBricks> bricks;
  std::vector<Eigen::Vector3i> refined;  // Of the level before.
  for (std::size_t level = 0; level < plans.size(); ++level) {
    const LevelPlan& plan = plans[level];
    const auto refined_by_next = [&](const BrickIndex* existing) {
      if (level + 1 == plans.size()) return std::vector<Eigen::Vector3i>();
      return refined_bricks(plans[level + 1].blocks.shapes, plan.extent, existing);
    };
    if (level == 0) {
      refined = refined_by_next(nullptr);
      bricks.push_back(coefficient_bricks(plan.table, plan.extent, used, refined));
    } else if (!refined.empty()) {
      bricks.push_back(finer_bricks(plan.table, refined, plan.extent, used));
      refined = refined_by_next(&bricks.back().index);
    }
  }
  return bricks;
}

/// Makes the bricks of all levels. @param norm  Becomes the greatest squared norm.
/// @return nothing if tensors do not fit into `memory`, because they are not symmetric.
std::vector<BrickList> make_levels(const std::vector<LevelPlan>& plans, const std::vector<CoefficientBricks>& bricks,
                                   const Interpolant& used, const BrickMemory& memory, double& norm) {
  std::vector<BrickList> lists;
  BrickMemory before;
  std::size_t first = 0;
  for (std::size_t level = 0; level < bricks.size(); ++level) {
    const CoefficientBricks& made = bricks[level];
    const BrickMemory within = bricks_from(memory, first, made.count), blocks = blocks_within(within, made);
    const CoarserLevel coarser{level == 0 ? made.index : bricks[level - 1].index, before};
    const Coefficients field{made, plans[level].extent, used, blocks, level == 0 ? nullptr : &coarser};
    if (!place_blocks(plans[level], field, norm)) return {};
    continue_values(field);
    BrickList list;
    list.strongest = make_coefficients(field, within);
    list.places.assign(made.places.begin(), made.places.begin() + static_cast<std::ptrdiff_t>(made.count));
    lists.push_back(std::move(list));
    before = within;
    first += made.count;
  }
  return lists;
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
  check_levels(source, voxels, interpolant);
  const Interpolant used = used_interpolant(interpolant, !source.surface.triangles.empty());
  index_bounds_ = extent_of(voxels);
  voxels_ = Eigen::AlignedBox3d(voxels.min().cast<double>(), voxels.max().cast<double>());

  // Blocks of voxels become those of coefficients, from which bricks are made.
  const std::vector<LevelPlan> plans = plans_of(source, voxels);
  const std::vector<CoefficientBricks> bricks = bricks_of(plans, used);
  for (const int components : {TensorBrick::symmetric, TensorBrick::general}) {  // Any tensors fit the second time.
    memory_ = {};
    memory_ = brick_memory(bricks, interpolant.between, components);
    double norm = 0;
    bricks_ = make_levels(plans, bricks, used, memory_, norm);
    max_norm_ = std::sqrt(norm);
    if (!bricks_.empty()) break;
  }
  std::size_t count = 0;
  for (const BrickList& level : bricks_) count += level.places.size();
  keep_bricks(memory_, count);
  make_indices();
}

TensorField::TensorField(FieldParts parts)
    : interpolant_(parts.interpolant),
      to_world_(parts.to_world),
      to_index_(parts.to_world.inverse()),
      index_bounds_(extent_of(parts.voxels)),
      voxels_(parts.voxels.cast<double>()),
      bricks_(std::move(parts.levels)),
      memory_(std::move(parts.memory)),
      surface_(std::make_shared<const TriangleMesh>(std::move(parts.surface))),
      max_norm_(parts.max_norm) {
  make_indices();
}

void TensorField::make_indices() {
  trailing_offset_ = static_cast<std::size_t>(is_cubic() ? CubicBrick::trailing_offset(memory_.components)
                                                         : LinearBrick::trailing_offset(memory_.components));
  if (bricks_.size() > 1) family_of_.assign(memory_.count, BrickIndex::missing);
  std::size_t end = memory_.count;
  for (std::size_t level = bricks_.size() - 1; level > 0; --level) {
    const BrickList& finer = bricks_[level];
    BrickList& coarser = bricks_[level - 1];
    const BrickIndex parents(coarser.places);
    const std::size_t first = end - finer.places.size(), first_parent = first - coarser.places.size();
    for (std::size_t i = 0; i < finer.places.size(); ++i) {
      const Eigen::Vector3i place = finer.places[i], half = place.unaryExpr([](int v) { return v & 1; });
      const std::uint32_t parent = parents.find((place - half) / 2);
      std::uint32_t& family = family_of_[first_parent + parent];
      if (family == BrickIndex::missing) {
        family = static_cast<std::uint32_t>(families_.size());
        families_.emplace_back();
      }
      families_[family][static_cast<std::size_t>(half.x() * 4 + half.y() * 2 + half.z())] = {
          static_cast<std::uint32_t>(first + i), finer.strongest[i]};
      coarser.strongest[parent] = std::max(coarser.strongest[parent], finer.strongest[i]);
    }
    end = first;
  }
  index_ = BrickIndex(bricks_[0].places);
  index_.set_values(bricks_[0].strongest);
}

LeafBrick TensorField::leaf_within(BrickIndex::Entry entry, const std::array<float, 3>& position) const {
  LeafBrick leaf;
  float half = TensorBrick::cells / 2;
  while (entry.number != BrickIndex::missing && family_of_[entry.number] != BrickIndex::missing) {
    std::size_t member = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool upper = position[axis] >= leaf.first[axis] + half;
      if (upper) leaf.first[axis] += half;
      member = 2 * member + (upper ? 1 : 0);
    }
    entry = families_[family_of_[entry.number]][member];
    leaf.scale *= 2;
    half /= 2;
  }
  leaf.brick = brick_at(entry.number == BrickIndex::missing ? zeros : memory_.brick(entry.number), entry.value);
  return leaf;
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
  return brick_count() * (memory_.stride * sizeof(float) + sizeof(Eigen::Vector3i)) + index_.memory_bytes() +
         families_.size() * sizeof(Family) + family_of_.size() * sizeof(family_of_[0]);
}

DepthRange depth_range(const TensorField& field, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  DepthRange range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const Eigen::Vector3d& corner : field.corners()) {
    range.near = std::min(range.near, (corner - origin).dot(direction));
    range.far = std::max(range.far, (corner - origin).dot(direction));
  }
  return range;
}

}  // namespace tensorray
