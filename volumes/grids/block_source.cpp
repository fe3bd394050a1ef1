#include "volumes/grids/block_source.h"

#include <array>
#include <memory>
#include <utility>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

constexpr int size = TensorBlock::size;

/// The voxels of the block at `origin` that are in `box`.
std::bitset<TensorBlock::voxels> voxels_within(const Eigen::Vector3i& origin, const Eigen::AlignedBox3i& box) {
  std::bitset<TensorBlock::voxels> active;
  if (box.contains(origin) && box.contains(Eigen::Vector3i(origin.array() + (size - 1)))) return active.set();
  for (int offset = 0; offset < TensorBlock::voxels; ++offset)
    active[static_cast<std::size_t>(offset)] = box.contains(Eigen::Vector3i(origin + TensorBlock::position(offset)));
  return active;
}

/// The shapes of the blocks of a dense grid.
std::vector<BlockShape> dense_shapes(const Eigen::AlignedBox3i& box) {
  // Blocks are counted, and not their voxels: the index after the last voxel may be none.
  const auto block_of = [](int index) { return (index - (index & (size - 1))) / size; };
  const Eigen::Vector3i first = box.min().unaryExpr(block_of), last = box.max().unaryExpr(block_of);
  std::vector<BlockShape> shapes;
  for (int x = first.x(); x <= last.x(); ++x)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int z = first.z(); z <= last.z(); ++z)
        shapes.push_back({size * Eigen::Vector3i(x, y, z), voxels_within(size * Eigen::Vector3i(x, y, z), box)});
  return shapes;
}

void fill_block(TensorBlock& block, const std::function<Eigen::Matrix3d(const Eigen::Vector3i&)>& value) {
  for (int offset = 0; offset < TensorBlock::voxels; ++offset)
    if (block.active[offset]) block.values[offset] = value(block.origin + TensorBlock::position(offset)).cast<float>();
}

}  // namespace

void read_block(const BlockShape& shape, const std::function<void(std::size_t, TensorBlock&)>& fill, std::size_t i,
                TensorBlock& block) {
  block.origin = shape.origin;
  block.active = shape.active;
  if (!block.active.all()) block.values.fill(Eigen::Matrix3f::Zero());
  fill(i, block);
}

void read_block(const BlockSource& source, std::size_t i, TensorBlock& block) {
  read_block(source.shapes[i], source.fill, i, block);
}

BlockSource dense_source(const Eigen::AlignedBox3i& box, const Eigen::Affine3d& to_world,
                         const std::function<Eigen::Matrix3d(const Eigen::Vector3i&)>& value) {
  BlockSource source;
  source.to_world = to_world;
  source.shapes = dense_shapes(box);
  source.fill = [value](std::size_t, TensorBlock& block) { fill_block(block, value); };
  return source;
}

std::vector<BlockShape> shapes_within(const std::vector<Eigen::Vector3i>& bricks, const Eigen::AlignedBox3i& extent) {
  std::map<std::array<int, 3>, std::bitset<TensorBlock::voxels>> found;
  for (const Eigen::Vector3i& brick : bricks) {
    Eigen::AlignedBox3i box(2 * size * brick, (2 * size * brick).array() + 2 * size);  // With its last faces.
    for (int axis = 0; axis < 3; ++axis)
      if (box.max()[axis] != extent.max()[axis]) --box.max()[axis];
    box = box.intersection(extent);
    for (const BlockShape& shape : dense_shapes(box))
      found[{shape.origin.x(), shape.origin.y(), shape.origin.z()}] |= shape.active;
  }
  std::vector<BlockShape> shapes;
  for (const auto& [origin, active] : found) shapes.push_back({{origin[0], origin[1], origin[2]}, active});
  return shapes;
}

BlockSource view_of(const TensorGrid& grid) {
  const auto fill_from = [](const TensorBlocks& blocks) {
    return [&blocks](std::size_t i, TensorBlock& block) { block.values = blocks[i].values; };
  };
  BlockSource source{grid.name, grid.to_world, grid.shapes(), grid.metadata, grid.surface, fill_from(grid.blocks)};
  for (const TensorBlocks& blocks : grid.finer) source.finer.push_back({shapes_of(blocks), fill_from(blocks)});
  return source;
}

BlockSource source_of(TensorGrid grid) {
  const auto kept = std::make_shared<const TensorGrid>(std::move(grid));
  BlockSource source = view_of(*kept);
  const auto keep = [&kept](auto& fill) {
    fill = [kept, from = fill](std::size_t i, TensorBlock& block) { from(i, block); };
  };
  keep(source.fill);
  for (BlockLevel& level : source.finer) keep(level.fill);
  return source;
}

TensorGrid to_grid(const BlockSource& source) {
  const auto read = [](const std::vector<BlockShape>& shapes, const auto& fill) {
    TensorBlocks blocks = unset_blocks(shapes.size());
    tbb::parallel_for(std::size_t{0}, shapes.size(), [&](std::size_t i) { read_block(shapes[i], fill, i, blocks[i]); });
    return blocks;
  };
  TensorGrid grid;
  grid.name = source.name;
  grid.to_world = source.to_world;
  grid.metadata = source.metadata;
  grid.surface = source.surface;
  grid.blocks = read(source.shapes, source.fill);
  for (const BlockLevel& level : source.finer) grid.finer.push_back(read(level.shapes, level.fill));
  return grid;
}

}  // namespace tensorray
