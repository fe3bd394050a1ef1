#include "volumes/bricks/coefficient_bricks.h"

#include <map>
#include <tuple>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

using Eigen::AlignedBox3i;
using Eigen::Vector3i;

constexpr int block_edge = TensorBlock::size;
static_assert(CoefficientBlock::width == block_edge, "a brick has the coefficients of a block, and some about it");

int reach_of(const Interpolant& interpolant) {
  return interpolant.border == Border::extend ? 2 : interpolant.between == Interpolation::linear ? 0 : 1;
}

/// The places of the blocks, and all about them.
std::vector<Vector3i> places_about(const BlockTable& table) {
  std::vector<Vector3i> places = table.places;
  for (const Vector3i& place : table.places)
    for (int n = 0; n < neighbour_count; ++n)
      if (const Vector3i at = place + neighbour(n); table.index.find(at) == BrickIndex::missing) places.push_back(at);
  sort_places(places);
  return places;
}

/// The voxels of a block that are set, or have one that is within `reach` along an axis.
/// @param before, after  Of the neighbours along it; null: none.
VoxelMask spread(const VoxelMask& mask, int axis, int reach, const VoxelMask* before, const VoxelMask* after) {
  VoxelMask result{};
  const auto row = [&](int x, int y) -> unsigned {
    const int at = axis == 0 ? x : y;
    const VoxelMask* const from = at < 0 ? before : at >= block_edge ? after : &mask;
    return from ? (*from)[static_cast<std::size_t>((x & 7) * block_edge + (y & 7))] : 0u;
  };
  for (int x = 0; x < block_edge; ++x)
    for (int y = 0; y < block_edge; ++y) {
      const auto i = static_cast<std::size_t>(x * block_edge + y);
      const unsigned along_z = (before ? (*before)[i] : 0u) | unsigned{mask[i]} << 8 | (after ? (*after)[i] : 0u) << 16;
      unsigned any = 0;
      for (int k = -reach; k <= reach; ++k)
        any |= axis == 0 ? row(x + k, y) : axis == 1 ? row(x, y + k) : along_z >> (block_edge + k);
      result[i] = static_cast<std::uint8_t>(any);
    }
  return result;
}

/// How many voxels a brick needs of the blocks before and behind its own, along each axis.
struct Apron {
  int before, behind;
};

Apron apron_of(Interpolation between) {
  return between == Interpolation::linear ? Apron{LinearBrick::before, LinearBrick::behind}
                                          : Apron{CubicBrick::before, CubicBrick::behind};
}

/// Whether a brick whose block is `offset` from another one's needs coefficients of that one.
bool reaches(const VoxelMask& mask, const Vector3i& offset, const Apron& apron) {
  const auto first = [&](int o) { return o > 0 ? block_edge - apron.before : 0; };
  const auto end = [&](int o) { return o < 0 ? apron.behind : block_edge; };
  unsigned along_z = 0;
  for (int z = first(offset.z()); z < end(offset.z()); ++z) along_z |= 1u << z;
  for (int x = first(offset.x()); x < end(offset.x()); ++x)
    for (int y = first(offset.y()); y < end(offset.y()); ++y)
      if ((mask[static_cast<std::size_t>(x * block_edge + y)] & along_z) != 0) return true;
  return false;
}

/// Three slabs are in use at a time: one is solved, and bricks are made of the one before it with what they need of a
/// third. With a bound of memory, these may take half of it.
std::size_t max_places_of_slab() {
  const std::size_t bytes = memory_bound() ? *memory_bound() / 12 : std::size_t{1} << 26;
  return bytes / (static_cast<std::size_t>(CoefficientBlock::stored_floats(TensorBrick::general)) * sizeof(float));
}

}  // namespace

Vector3i place_of(const Vector3i& voxel) {
  return voxel.unaryExpr([](int v) { return v >> 3; });
}

bool any_of(const VoxelMask& mask) {
  return std::any_of(mask.begin(), mask.end(), [](std::uint8_t row) { return row != 0; });
}

VoxelMask mask_of(const BlockShape& shape) {
  VoxelMask mask{};
  if (shape.active.all()) mask.fill(0xff);
  if (shape.active.all()) return mask;
  for (std::size_t row = 0; row < mask.size(); ++row)
    for (std::size_t z = 0; z < block_edge; ++z)
      mask[row] = static_cast<std::uint8_t>(mask[row] | (shape.active[row * block_edge + z] ? 1u << z : 0u));
  return mask;
}

void cut(VoxelMask& mask, const Vector3i& place, const AlignedBox3i& extent) {
  const Vector3i low = (extent.min() - block_edge * place).cwiseMax(0),
                 high = (extent.max() - block_edge * place).cwiseMin(block_edge - 1);
  unsigned along_z = 0;
  for (int z = low.z(); z <= high.z(); ++z) along_z |= 1u << z;
  for (int x = 0; x < block_edge; ++x)
    for (int y = 0; y < block_edge; ++y) {
      const bool inside = x >= low.x() && x <= high.x() && y >= low.y() && y <= high.y();
      std::uint8_t& row = mask[static_cast<std::size_t>(x * block_edge + y)];
      row = inside ? static_cast<std::uint8_t>(row & along_z) : std::uint8_t{0};
    }
}

void sort_places(std::vector<Vector3i>& places) {
  tbb::parallel_sort(places.begin(), places.end(), [](const Vector3i& a, const Vector3i& b) {
    return std::make_tuple(a.x(), a.y(), a.z()) < std::make_tuple(b.x(), b.y(), b.z());
  });
  places.erase(std::unique(places.begin(), places.end()), places.end());
}

AlignedBox3i bricks_with_cells(const AlignedBox3i& voxels) {
  return {place_of(voxels.min()), place_of((voxels.max().array() - 1).matrix().cwiseMax(voxels.min()))};
}

BlockTable::BlockTable(const std::vector<BlockShape>& all) : shapes(all) {
  places.reserve(shapes.size());
  for (const BlockShape& shape : shapes) places.emplace_back(shape.origin / block_edge);
  index = BrickIndex(places);
}

std::vector<PlaceNumbers> slabs_of(const std::vector<Vector3i>& places, std::size_t most) {
  std::map<int, PlaceNumbers> by_x;
  for (std::uint32_t i = 0; i < places.size(); ++i) by_x[places[i].x()].push_back(i);
  std::vector<PlaceNumbers> slabs;
  for (const auto& [x, numbers] : by_x)
    if (slabs.empty() || slabs.back().size() + numbers.size() > most)
      slabs.push_back(numbers);
    else
      slabs.back().insert(slabs.back().end(), numbers.begin(), numbers.end());
  return slabs;
}

std::vector<VoxelMask> filled_voxels(const std::vector<Vector3i>& places, const BrickIndex& found,
                                     const std::vector<VoxelMask>& active, const AlignedBox3i& extent,
                                     const Interpolant& interpolant) {
  const int reach = reach_of(interpolant);
  std::vector<VoxelMask> filled = active;
  for (int axis = 0; reach > 0 && axis < 3; ++axis) {
    const std::vector<VoxelMask> from = filled;
    const auto mask_at = [&](const Vector3i& place) {
      const std::uint32_t at = found.find(place);
      return at == BrickIndex::missing ? nullptr : &from[at];
    };
    tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) {
      const Vector3i along = Vector3i::Unit(axis);
      filled[i] = spread(from[i], axis, reach, mask_at(places[i] - along), mask_at(places[i] + along));
      if (axis == 2) cut(filled[i], places[i], extent);
    });
  }
  return filled;
}

void make_slabs(CoefficientBricks& bricks) { bricks.slabs = slabs_of(bricks.places, max_places_of_slab()); }

CoefficientBricks coefficient_bricks(const BlockTable& table, const AlignedBox3i& extent,
                                     const Interpolant& interpolant, const std::vector<Vector3i>& refined) {
  const std::vector<Vector3i> candidates = reach_of(interpolant) == 0 ? table.places : places_about(table);
  const BrickIndex found(candidates);
  std::vector<VoxelMask> active(candidates.size());
  tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t i) {
    const std::uint32_t block = table.index.find(candidates[i]);
    if (block != BrickIndex::missing) active[i] = mask_of(table.shapes[block]);
  });
  const std::vector<VoxelMask> filled = filled_voxels(candidates, found, active, extent, interpolant);

  const AlignedBox3i with_cells = bricks_with_cells(extent);
  CoefficientBricks result;
  result.places = refined;
  std::vector<Vector3i> others;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!any_of(filled[i])) continue;
    (with_cells.contains(candidates[i]) ? result.places : others).push_back(candidates[i]);
    for (int n = 0; n < neighbour_count; ++n) {
      const Vector3i offset = neighbour(n), at = candidates[i] + offset;
      const std::uint32_t other = found.find(at);
      if (other != BrickIndex::missing && any_of(filled[other])) continue;
      if (with_cells.contains(at) && reaches(filled[i], offset, apron_of(interpolant.between)))
        result.places.push_back(at);
    }
  }
  sort_places(result.places);
  result.count = result.places.size();
  result.places.insert(result.places.end(), others.begin(), others.end());
  result.index = BrickIndex(result.places);
  make_slabs(result);
  for (const Vector3i& place : result.places) {
    const std::uint32_t at = found.find(place);
    result.filled.push_back(at == BrickIndex::missing ? VoxelMask{} : filled[at]);
    result.active.push_back(at == BrickIndex::missing ? VoxelMask{} : active[at]);
  }
  return result;
}

StoredTensor read_coefficient(const BrickMemory& blocks, const BlockVoxel& voxel) {
  StoredTensor value = StoredTensor::Zero();
  const float* const floats = blocks.brick(voxel.block);
  const int number = CoefficientBlock::coefficient(voxel.x, voxel.y, voxel.z);
  std::copy_n(floats + CoefficientBlock::bending_offset(blocks.components, number), blocks.components, value.data());
  value[8] = floats[CoefficientBlock::trailing_offset(blocks.components) + number];
  return value;
}

std::optional<BlockVoxel> find_voxel(const CoefficientBricks& bricks, const std::vector<VoxelMask>& masks,
                                     const Vector3i& index) {
  const std::uint32_t block = bricks.index.find(place_of(index));
  if (block == BrickIndex::missing) return std::nullopt;
  const BlockVoxel voxel{block, index.x() & 7, index.y() & 7, index.z() & 7};
  if (!is_set(masks[block], voxel.x, voxel.y, voxel.z)) return std::nullopt;
  return voxel;
}

bool is_free(const CoefficientBricks& bricks, const Vector3i& index) {
  const std::uint32_t block = bricks.free.empty() ? BrickIndex::missing : bricks.index.find(place_of(index));
  return block == BrickIndex::missing || is_set(bricks.free[block], index.x() & 7, index.y() & 7, index.z() & 7);
}

}  // namespace tensorray
