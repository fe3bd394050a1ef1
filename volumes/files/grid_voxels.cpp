#include "volumes/files/grid_voxels.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <istream>
#include <new>
#include <streambuf>
#include <string>

#include <openvdb/io/Compression.h>
#include <tbb/parallel_for.h>

#include "base/errors.h"
#include "base/process/process_limits.h"
#include "base/text/text.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

/// More blocks than fit in any machine's memory. An active tile at the root of a tree would expand to as many.
constexpr std::size_t max_block_count = std::size_t{1} << 25;

/// Voxels may have indices from −max_index to max_index along each axis. Then sizes, and the indices of neighbours, are
/// integers of 32 bits. 2²⁹ voxels of a micrometre are half a kilometre.
constexpr std::int32_t max_index = 1 << 29;

void require_extent(const std::filesystem::path& path, const Eigen::Vector3i& min, const Eigen::Vector3i& max) {
  if ((min.array() >= -max_index).all() && (max.array() <= max_index).all()) return;
  fail(path, "has voxels whose indices are beyond " + std::to_string(max_index) +
                 "; the file is damaged, or its grid has to be moved to the origin");
}

/// Calls `visit(tree)` with the grid's tree as its actual type.
template <class Visit>
void with_tree(const FieldGrid& grid, const Visit& visit) {
  const openvdb::GridBase& typeless = *grid.file.grid;
  typeless.apply<FieldGridTypes>([&](const auto& typed) { visit(typed.tree()); });
}

Eigen::Vector3i index_of(const openvdb::Coord& at) { return {at.x(), at.y(), at.z()}; }

template <class Tree>
void add_tile_origins(const std::filesystem::path& path, const Tree& tree, std::vector<openvdb::Coord>& origins) {
  constexpr int size = TensorBlock::size;
  auto tile = tree.cbeginValueOn();
  tile.setMaxDepth(Tree::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    openvdb::CoordBBox box;
    tile.getBoundingBox(box);
    require_extent(path, index_of(box.min()), index_of(box.max()));  // The loops below would overflow.
    const std::size_t count = origins.size() + box.volume() / TensorBlock::voxels;
    if (count > max_block_count) throw std::bad_alloc();
    require_memory(path, count, sizeof(openvdb::Coord));
    for (int x = box.min().x(); x <= box.max().x(); x += size)
      for (int y = box.min().y(); y <= box.max().y(); y += size)
        for (int z = box.min().z(); z <= box.max().z(); z += size) origins.emplace_back(x, y, z);
  }
}

/// The origins of all leaves and tiles that have an active voxel, sorted.
std::vector<openvdb::Coord> block_origins(const std::filesystem::path& path, const std::vector<FieldGrid>& grids) {
  std::vector<openvdb::Coord> origins;
  for (const FieldGrid& grid : grids)
    with_tree(grid, [&](const auto& tree) {
      static_assert(std::decay_t<decltype(tree)>::LeafNodeType::DIM == TensorBlock::size, "leaves are blocks");
      for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)
        if (!leaf->isEmpty()) {
          require_extent(path, index_of(leaf->origin()), index_of(leaf->origin()));
          origins.push_back(leaf->origin());
        }
      add_tile_origins(path, tree, origins);
    });
  std::sort(origins.begin(), origins.end());
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
  return origins;
}

/// The active voxels of a tree in the block at `origin`.
template <class Tree>
std::bitset<TensorBlock::voxels> active_voxels_at(const Tree& tree, const openvdb::Coord& origin) {
  std::bitset<TensorBlock::voxels> active;
  if (const auto* leaf = tree.probeConstLeaf(origin)) return voxel_mask(*leaf);
  return tree.isValueOn(origin) ? active.set() : active;
}

/// Bytes as a stream that OpenVDB reads.
class ByteBuffer : public std::streambuf {
 public:
  explicit ByteBuffer(std::vector<char>& bytes) { setg(bytes.data(), bytes.data(), bytes.data() + bytes.size()); }
};

/// Reads the values of a leaf from the file; those of inactive voxels may be any.
template <class Leaf>
void read_leaf(const StoredLeaves& stored, const Leaf& leaf, typename Leaf::ValueType* values) {
  const StoredLeaf& place = stored.leaves[leaf.transientData()];
  thread_local std::vector<char> bytes;
  bytes.resize(static_cast<std::size_t>(place.bytes));
  if (!stored.file->read(place.at, bytes.data(), bytes.size()) || !is_same(place, stored.tree, bytes.data()))
    throw FormatError();
  ByteBuffer buffer(bytes);
  std::istream stream(&buffer);
  openvdb::io::setCurrentVersion(stream);  // The format of values is the same in all versions that read_vdb leaves.
  openvdb::io::setDataCompression(stream, stored.compression);
  openvdb::io::readCompressedValues(stream, values, Leaf::SIZE, leaf.valueMask(), stored.tree.half);
  if (!stream) throw FormatError();
}

template <class Number>
Number component(Number value, int) {
  return value;
}

template <class T>
T component(const openvdb::math::Vec3<T>& value, int i) {
  return value[i];
}

template <class Value>
void put_value(TensorBlock& block, int offset, const TensorEntry& entry, const Value& value) {
  block.values[offset](entry.row, entry.column) = static_cast<float>(component(value, entry.component));
}

template <class Value>
void put_value(SampleBlock& block, int offset, const TensorEntry& entry, const Value& value) {
  block.values[offset][entry.row] = component(value, entry.component);
}

/// Writes the values of the voxels that are in `mask`.
template <class Value, class Block>
void put_all(const std::bitset<TensorBlock::voxels>& mask, const std::vector<TensorEntry>& entries, const Value* values,
             Block& block) {
  const bool is_dense = mask.all();
  for (const TensorEntry entry : entries)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (is_dense || mask[static_cast<std::size_t>(offset)]) put_value(block, offset, entry, values[offset]);
}

template <class Tree, class Block>
void put_tree(const Tree& tree, const FieldGrid& grid, Block& block) {
  using Leaf = typename Tree::LeafNodeType;
  const openvdb::Coord origin = coord_of(block.origin);
  const auto mask = active_voxels_at(tree, origin);
  if (mask.none()) return;
  std::array<typename Leaf::ValueType, Leaf::SIZE> values;
  const Leaf* const leaf = tree.probeConstLeaf(origin);
  if (leaf)
    read_leaf(*grid.file.stored, *leaf, values.data());
  else
    values.fill(tree.getValue(origin));
  put_all(mask, grid.entries, values.data(), block);
}

template <class Block>
void put_grids(const std::filesystem::path& path, const std::vector<FieldGrid>& grids, Block& block) {
  try {
    for (const FieldGrid& grid : grids) with_tree(grid, [&](const auto& tree) { put_tree(tree, grid, block); });
  } catch (const FormatError&) {
    fail_damaged_voxels(path);
  } catch (const openvdb::Exception&) {
    fail_damaged_voxels(path);
  }
}

}  // namespace

void require_memory(const std::filesystem::path& path, std::size_t blocks, std::size_t block_bytes) {
  if (memory_bound()) return;
  const double bytes = static_cast<double>(blocks) * static_cast<double>(block_bytes);
  const MemoryLimit limit = memory_limit();
  if (bytes > limit.bytes)
    fail(path, "its active voxels need " + bytes_text(bytes) + ", more than " + limit.cause + ", " +
                   bytes_text(limit.bytes) + "; resample it more coarsely, or give --memory");
}

std::vector<BlockShape> find_blocks(const std::filesystem::path& path, const std::vector<FieldGrid>& grids,
                                    std::size_t block_bytes) {
  const std::vector<openvdb::Coord> origins = block_origins(path, grids);
  require_memory(path, origins.size(), block_bytes);
  std::vector<BlockShape> shapes(origins.size());
  tbb::parallel_for(std::size_t{0}, origins.size(), [&](std::size_t i) {
    shapes[i].origin = index_of(origins[i]);
    for (const FieldGrid& grid : grids)
      with_tree(grid, [&](const auto& tree) { shapes[i].active |= active_voxels_at(tree, origins[i]); });
  });
  // In a damaged tree, a leaf may not be found at its origin.
  const auto is_empty = [](const BlockShape& shape) { return shape.active.none(); };
  shapes.erase(std::remove_if(shapes.begin(), shapes.end(), is_empty), shapes.end());
  return shapes;
}

void put_values(const std::filesystem::path& path, const std::vector<FieldGrid>& grids, TensorBlock& block) {
  put_grids(path, grids, block);
}

void put_values(const std::filesystem::path& path, const std::vector<FieldGrid>& grids, SampleBlock& block) {
  put_grids(path, grids, block);
}

}  // namespace tensorray
