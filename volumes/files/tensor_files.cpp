#include "volumes/files/tensor_files.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <type_traits>
#include <unordered_map>

#include <malloc.h>
#include <tbb/parallel_for.h>

#include "base/errors.h"
#include "base/text.h"
#include "volumes/files/stored_field.h"
#include "volumes/files/vdb_archive.h"
#include "volumes/files/vdb_transform.h"
#include "volumes/files/voxel_extent.h"
#include "volumes/grids/page_memory.h"
#include "volumes/tensors/finite_differences.h"

namespace tensorray {
namespace {

constexpr double greatest_half = 65504;

/// More blocks than fit in any machine's memory. An active tile at the root of a tree would expand to as many.
constexpr std::size_t greatest_block_count = std::size_t{1} << 25;

/// What a field needs at least for a block, when its tensors are symmetric (TensorBrick).
constexpr std::size_t least_brick_bytes = 14000;

using Entry = TensorEntry;

/// A grid, and the tensor entries that its values are stored in.
struct Source {
  openvdb::GridBase::ConstPtr grid;
  std::vector<Entry> entries;
};

/// Calls `visit(tree)` with the grid's tree as its actual type.
template <class Visit>
void with_tree(const openvdb::GridBase& grid, const Visit& visit) {
  using namespace openvdb;
  if (grid.isType<Vec3SGrid>()) visit(static_cast<const Vec3SGrid&>(grid).tree());
  if (grid.isType<Vec3DGrid>()) visit(static_cast<const Vec3DGrid&>(grid).tree());
  if (grid.isType<FloatGrid>()) visit(static_cast<const FloatGrid&>(grid).tree());
  if (grid.isType<DoubleGrid>()) visit(static_cast<const DoubleGrid&>(grid).tree());
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
    if (count > greatest_block_count) throw std::bad_alloc();
    require_memory(path, count, sizeof(openvdb::Coord));
    for (int x = box.min().x(); x <= box.max().x(); x += size)
      for (int y = box.min().y(); y <= box.max().y(); y += size)
        for (int z = box.min().z(); z <= box.max().z(); z += size) origins.emplace_back(x, y, z);
  }
}

/// The origins of all blocks that have an active voxel, sorted.
std::vector<openvdb::Coord> block_origins(const std::filesystem::path& path, const std::vector<Source>& sources) {
  std::vector<openvdb::Coord> origins;
  for (const Source& source : sources)
    with_tree(*source.grid, [&](const auto& tree) {
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

double component(double value, int) { return value; }
template <class T>
double component(const openvdb::math::Vec3<T>& value, int i) {
  return value[i];
}

/// Calls `put(offset, value)` for the active voxels of a tree in the block at `origin`.
template <class Tree, class Put>
void for_each_in_block(const Tree& tree, const openvdb::Coord& origin, const Put& put) {
  if (const auto* leaf = tree.probeConstLeaf(origin)) {
    if (leaf->isDense()) {
      const auto* const values = leaf->buffer().data();
      for (int offset = 0; offset < TensorBlock::voxels; ++offset) put(offset, values[offset]);
      return;
    }
    for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel) put(static_cast<int>(voxel.pos()), *voxel);
  } else if (tree.isValueOn(origin)) {
    const auto value = tree.getValue(origin);
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) put(offset, value);
  }
}

void put(TensorBlock& block, int offset, const Entry& entry, double value) {
  block.values[offset](entry.row, entry.column) = static_cast<float>(value);
}

void put(SampleBlock& block, int offset, const Entry& entry, double value) { block.values[offset][entry.row] = value; }

/// Appends the blocks (TensorBlock or SampleBlock) of all active voxels, including those of active tiles, and no
/// others.
template <class Blocks>
void add_blocks(const std::filesystem::path& path, const std::vector<Source>& sources, Blocks& blocks) {
  const std::vector<openvdb::Coord> origins = block_origins(path, sources);
  const std::size_t first = blocks.size();
  require_memory(path, first + origins.size(), sizeof(typename Blocks::value_type));
  Blocks::allocator_type::prepare(origins.size());
  blocks.resize(first + origins.size());
  tbb::parallel_for(std::size_t{0}, origins.size(), [&](std::size_t i) {
    make_room();
    auto& block = blocks[first + i];
    block.origin = {origins[i].x(), origins[i].y(), origins[i].z()};
    for (const Source& source : sources)
      with_tree(*source.grid, [&](const auto& tree) {
        for_each_in_block(tree, origins[i], [&](int offset, const auto& value) {
          block.active.set(offset);
          for (const Entry& entry : source.entries) put(block, offset, entry, component(value, entry.component));
        });
      });
  });
}

/// Whether two transforms differ by less than a millionth of a voxel per voxel, and by less than a thousandth of a
/// voxel anywhere.
bool same_transform(const Eigen::Affine3d& a, const Eigen::Affine3d& b) {
  const Eigen::Matrix4d difference = (a.inverse() * b).matrix() - Eigen::Matrix4d::Identity();
  return difference.leftCols<3>().norm() < 1e-6 && difference.col(3).norm() < 1e-3;
}

Eigen::Affine3d common_transform(const std::filesystem::path& path, const std::vector<Source>& sources) {
  const Eigen::Affine3d first = placement(path, *sources.front().grid);
  for (const Source& source : sources)
    if (!same_transform(first, placement(path, *source.grid)))
      fail(path, "grids " + sources.front().grid->getName() + " and " + source.grid->getName() +
                     " have different transforms; resample them to one");
  return first;
}

std::string text_of(const openvdb::Metadata& value) {
  const auto* text = dynamic_cast<const openvdb::StringMetadata*>(&value);
  return text ? text->value() : value.str();
}

/// The file's metadata, and the entries that this program writes on grids, because some tools keep only the grids'
/// metadata.
std::map<std::string, std::string> metadata_of(const openvdb::MetaMap& file, const openvdb::GridBase& grid) {
  std::map<std::string, std::string> metadata;  // Without the unit: `placement` has applied it.
  for (auto i = file.beginMeta(); i != file.endMeta(); ++i) metadata[i->first] = text_of(*i->second);
  for (auto i = grid.beginMeta(); i != grid.endMeta(); ++i)
    if (i->first.rfind("tensorray:", 0) == 0) metadata.emplace(i->first, text_of(*i->second));
  metadata.erase(length_unit_key);
  return metadata;
}

std::vector<GridInfo> infos_of(const VdbFile& file) {
  std::vector<GridInfo> infos;
  for (const VdbGrid& grid : file.grids) {
    // "Tree_vec3s_5_4_3" is a tree of vec3s.
    std::string type = grid.type;
    if (type.rfind("Tree_", 0) == 0) type = type.substr(5, type.find('_', 5) - 5);
    infos.push_back({grid.name, type, grid.half ? "half" : "full"});
  }
  return infos;
}

/// The grids of a field in a file, in the order of its parts.
std::vector<Source> sources_of(const VdbFile& file, const FieldGrids& field) {
  std::vector<Source> sources;
  for (const FieldPart& part : field.parts)
    for (const VdbGrid& grid : file.grids)
      if (grid.name == part.grid) sources.push_back({grid.grid, part.entries});
  return sources;
}

std::set<std::string> grid_names(const FieldGrids& field) {
  std::set<std::string> names;
  for (const FieldPart& part : field.parts) names.insert(part.grid);
  return names;
}

/// Where there is a bound of memory, slabs across x of which each has its part of it; else one with everything.
/// @param sources  Grids without voxels. Their metadata say where they have some.
/// @param derives  Whether the tensors are made of the samples of all slabs, which are then in memory as well.
std::vector<openvdb::CoordBBox> slabs_of(const std::filesystem::path& path, const std::vector<Source>& sources,
                                         bool derives) {
  using openvdb::CoordBBox, openvdb::GridBase;
  CoordBBox all = CoordBBox::inf();
  constexpr double voxel_bytes = 36, sample_bytes = 24, brick_part = 1.5, leaf_bytes = 700, slab_part = 0.12;
  double voxels = 0;
  openvdb::Int32 first = all.max().x(), last = all.min().x();
  for (const Source& source : sources) {
    const GridBase& grid = *source.grid;
    const auto count = grid.getMetadata<openvdb::Int64Metadata>(GridBase::META_FILE_VOXEL_COUNT);
    const auto min = grid.getMetadata<openvdb::Vec3IMetadata>(GridBase::META_FILE_BBOX_MIN);
    const auto max = grid.getMetadata<openvdb::Vec3IMetadata>(GridBase::META_FILE_BBOX_MAX);
    if (!count || !min || !max)
      fail(path, "does not say how many voxels it has, which --memory needs; write it again with this program");
    require_extent(path, {min->value().x(), 0, 0}, {max->value().x(), 0, 0});  // Slabs are counted by it.
    voxels = std::max(voxels, static_cast<double>(count->value()));
    first = std::min(first, min->value().x());
    last = std::max(last, max->value().x());
  }
  const double leaves = voxels / TensorBlock::voxels * static_cast<double>(sources.size());
  require_room((brick_part * voxel_bytes + (derives ? sample_bytes : 0)) * voxels, leaf_bytes * leaves);
  const double slab = slab_part * static_cast<double>(*memory_bound()) / voxel_bytes;
  const double width = std::clamp(slab / std::max(1.0, voxels) * (static_cast<double>(last) - first + 1), 8.0, 1e9);
  std::vector<CoordBBox> slabs;
  for (double x = (first >> 3) * 8.0; x <= last; x += std::floor(width / 8) * 8) {
    slabs.push_back(all);
    slabs.back().min().x() = static_cast<openvdb::Int32>(x);
    if (slabs.size() > 1) slabs[slabs.size() - 2].max().x() = static_cast<openvdb::Int32>(x) - 1;
  }
  if (slabs.empty()) slabs.push_back(all);
  slabs.front().min().x() = all.min().x();  // Whatever the metadata say, no voxel is lost.
  return slabs;
}

openvdb::Coord coord(const Eigen::Vector3i& index) { return {index.x(), index.y(), index.z()}; }

/// One row of the tensors of a grid, which must outlive it, as a grid of vectors that is only for writing: its leaves
/// have masks, and get their values when they are written, one at a time.
class RowGrid : public openvdb::Vec3SGrid {
 public:
  using Leaf = openvdb::Vec3STree::LeafNodeType;

  RowGrid(const TensorGrid& grid, int row, bool is_half) : row_(row) {
    setName(grid.name + "_row" + std::to_string(row));
    place(*this, grid.to_world);
    setGridClass(openvdb::GRID_UNKNOWN);
    setVectorType(openvdb::VEC_INVARIANT);
    setSaveFloatAsHalf(is_half);
    for (const auto& [key, value] : grid.metadata)
      if (!(*this)[key] && key != length_unit_key)
        insertMeta(key, openvdb::StringMetadata(value));  // Keep the grid's own entries: name, type, ...
    for (const TensorBlock& block : grid.blocks) {
      make_room();
      auto* const leaf = new Leaf(openvdb::PartialCreate(), coord(block.origin));
      tree().addLeaf(leaf);  // The tree owns it.
      blocks_.emplace(leaf, &block);
      for (int offset = 0; offset < TensorBlock::voxels; ++offset)
        leaf->setActiveState(static_cast<openvdb::Index>(offset), block.active[offset]);
    }
  }

  /// What the file says that its voxels take.
  openvdb::Index64 memUsage() const override {
    return openvdb::Vec3SGrid::memUsage() + tree().leafCount() * Leaf::SIZE * sizeof(openvdb::Vec3s);
  }

  /// The format: the buffers of all leaves, in their order in the tree.
  void writeBuffers(std::ostream& file) const override {
    for (auto leaf = tree().cbeginLeaf(); leaf; ++leaf) {
      make_room();
      filled(*blocks_.at(&*leaf)).writeBuffers(file, saveFloatAsHalf());
    }
  }

 private:
  Leaf filled(const TensorBlock& block) const {
    Leaf leaf(coord(block.origin));
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      if (!block.active[offset]) continue;
      const auto values = block.values[offset].row(row_);
      leaf.setValueOn(static_cast<openvdb::Index>(offset), openvdb::Vec3s(values[0], values[1], values[2]));
    }
    return leaf;
  }

  const int row_;
  std::unordered_map<const Leaf*, const TensorBlock*> blocks_;
};

void check_half_range(const std::filesystem::path& path, const TensorGrid& grid) {
  for (const TensorBlock& block : grid.blocks) {
    make_room();
    for (const Eigen::Matrix3f& value : block.values)
      if ((value.array().abs() > greatest_half).any())
        fail(path, "a component exceeds 65504, the greatest 16-bit float; write single precision or scale the field");
  }
}

}  // namespace

std::vector<GridInfo> list_vdb(const std::filesystem::path& path) { return infos_of(read_vdb(path)); }

std::optional<BlockSource> open_tensor_vdb(const std::filesystem::path& path, const std::string& name,
                                           const ComponentGrids& components) {
  const FieldGrids grids = field_grids(path, list_vdb(path), name, Derive::none, components);
  std::optional<VdbLeafFile> file = read_vdb_leaves(path, grid_names(grids));
  if (!file) return std::nullopt;
  BlockSource result;
  result.name = grids.name;

  const auto field = std::make_shared<StoredField>(path);
  std::vector<Source> sources;
  for (const FieldPart& part : grids.parts) {
    VdbLeafGrid& grid = file->grids.at(part.grid);
    sources.push_back({grid.grid, part.entries});
    field->grids.push_back({grid.tree, std::move(grid.leaves), part.entries});
  }
  result.to_world = common_transform(path, sources);
  result.metadata = metadata_of(file->file.metadata, *sources.front().grid);
  result.shapes = find_blocks(*field);
  if (result.shapes.empty()) fail(path, "\"" + result.name + "\" has no active voxel");
  for (const BlockShape& shape : result.shapes) require_extent(path, shape.origin, shape.origin);
  require_memory(path, result.shapes.size(), least_brick_bytes);
  result.fill = [field](std::size_t i, TensorBlock& block) { fill_block(*field, i, block); };
  return result;
}

TensorGrid read_tensor_vdb(const std::filesystem::path& path, const std::string& name, Derive derive,
                           const ComponentGrids& components) {
  const bool is_bounded = memory_bound().has_value(), derives = derive != Derive::none;
  const auto fail_too_large = [&](const std::string& field) {
    fail(path, "the active voxels of \"" + field + "\" do not fit in memory; resample it more coarsely");
  };
  if (!is_bounded && !derives)
    if (const std::optional<BlockSource> source = open_tensor_vdb(path, name, components)) {
      try {
        return to_grid(*source);
      } catch (const std::bad_alloc&) {
        fail_too_large(source->name);
      }
    }
  const FieldGrids field = field_grids(path, list_vdb(path), name, derive, components);
  const std::set<std::string> wanted = grid_names(field);
  TensorGrid result;
  result.name = field.name;
  const openvdb::CoordBBox nothing(openvdb::Coord::max(), openvdb::Coord::max());
  VdbFile file = read_vdb(path, wanted, is_bounded ? &nothing : nullptr);
  std::vector<Source> sources = sources_of(file, field);
  result.to_world = common_transform(path, sources);
  result.metadata = metadata_of(file.metadata, *sources.front().grid);
  const bool is_staggered = sources.front().grid->getGridClass() == openvdb::GRID_STAGGERED;
  const auto read = [&](auto& blocks) {
    if (!is_bounded) return add_blocks(path, sources, blocks);
    for (const openvdb::CoordBBox& slab : slabs_of(path, sources, derives)) {
      sources.clear();
      file = {};  // Before the next one is read.
      malloc_trim(0);
      file = read_vdb(path, wanted, &slab);
      sources = sources_of(file, field);
      add_blocks(path, sources, blocks);
    }
  };
  try {
    if (!derives) read(result.blocks);
    if (derives) {
      SampleBlocks samples;
      read(samples);
      const Eigen::Matrix3d to_index = result.to_world.inverse().linear();
      result.blocks = derive == Derive::hessian ? hessian(samples, to_index)
                      : is_staggered            ? staggered_gradient(samples, to_index)
                                                : gradient(samples, to_index);
    }
  } catch (const std::bad_alloc&) {
    fail_too_large(result.name);
  }
  if (result.blocks.empty()) fail(path, "\"" + result.name + "\" has no active voxel");
  return result;
}

void write_tensor_vdb(const std::filesystem::path& path, const TensorGrid& grid, bool is_half) {
  if (is_half) check_half_range(path, grid);
  openvdb::GridPtrVec rows;
  for (int row = 0; row < 3; ++row) rows.push_back(std::make_shared<RowGrid>(grid, row, is_half));
  openvdb::MetaMap metadata;
  for (const auto& [key, value] : grid.metadata)
    if (key != length_unit_key) metadata.insertMeta(key, openvdb::StringMetadata(value));
  write_vdb(path, rows, metadata);
}

}  // namespace tensorray
