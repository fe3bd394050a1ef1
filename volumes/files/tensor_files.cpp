#include "volumes/files/tensor_files.h"

#include <array>
#include <functional>
#include <memory>
#include <set>
#include <stdexcept>
#include <unordered_map>

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "volumes/files/grid_voxels.h"
#include "volumes/files/surface_grids.h"
#include "volumes/grids/mirror.h"
#include "volumes/tensors/eigenvalues.h"
#include "volumes/tensors/finite_differences.h"

namespace tensorray {
namespace {

constexpr double max_half = 65504;

/// What a field needs at least for a block, when its tensors are symmetric (TensorBrick).
constexpr std::size_t min_brick_bytes = 14000, cubic_brick_bytes = 32000;

/// Whether two transforms differ by less than a millionth of a voxel per voxel, and by less than a thousandth of a
/// voxel anywhere.
bool same_transform(const Eigen::Affine3d& a, const Eigen::Affine3d& b) {
  const Eigen::Matrix4d difference = (a.inverse() * b).matrix() - Eigen::Matrix4d::Identity();
  return difference.leftCols<3>().norm() < 1e-6 && difference.col(3).norm() < 1e-3;
}

Eigen::Affine3d common_transform(const std::filesystem::path& path, const std::vector<FieldGrid>& grids) {
  const openvdb::GridBase& first = *grids.front().file.grid;
  const Eigen::Affine3d transform = placement(path, first);
  for (const FieldGrid& grid : grids)
    if (!same_transform(transform, placement(path, *grid.file.grid)))
      fail(path, "grids " + first.getName() + " and " + grid.file.grid->getName() +
                     " have different transforms; resample them to one");
  return transform;
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

/// What is derived from a grid has the unit of its values, for each unit of length. A unit of the whole file may be
/// that of another grid.
void derive_unit(const openvdb::GridBase& grid, Derive derive, std::map<std::string, std::string>& metadata) {
  const openvdb::Metadata::ConstPtr unit = grid["tensorray:units"];
  metadata.erase("tensorray:units");
  if (unit) metadata["tensorray:units"] = text_of(*unit) + (derive == Derive::hessian ? "/length^2" : "/length");
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

/// The grids of a level in a file, in the order of its parts.
std::vector<FieldGrid> field_grids_of(const VdbFile& file, const std::vector<FieldPart>& parts) {
  std::vector<FieldGrid> grids;
  for (const FieldPart& part : parts)
    for (const VdbGrid& grid : file.grids)
      if (grid.name == part.grid) grids.push_back({grid, part.entries});
  return grids;
}

/// Those of the field, and of its surface.
std::set<std::string> grid_names(const FieldGrids& field) {
  std::set<std::string> names = surface_names(field.name);
  for (const FieldPart& part : field.parts) names.insert(part.grid);
  for (const std::vector<FieldPart>& level : field.finer)
    for (const FieldPart& part : level) names.insert(part.grid);
  return names;
}

using Fill = std::function<void(std::size_t, TensorBlock&)>;

Fill fill_of(const std::filesystem::path& path, const std::vector<FieldGrid>& grids) {
  return [path, grids](std::size_t, TensorBlock& block) {
    block.values.fill(Eigen::Matrix3f::Zero());  // A voxel may be active in some of the grids alone.
    put_values(path, grids, block);
  };
}

/// The tensors of a level that are derived from the values of grids, in memory.
/// @param to_index  Linear part of the transform, from world to the level's index space.
TensorBlocks derived_blocks(const std::filesystem::path& path, const std::vector<FieldGrid>& grids, Derive derive,
                            const std::vector<BlockShape>& shapes, const Eigen::Matrix3d& to_index) {
  SampleBlocks samples(shapes.size());
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
    static_cast<BlockShape&>(samples[i]) = shapes[i];
    put_values(path, grids, samples[i]);
  });
  const bool is_staggered = grids.front().file.grid->getGridClass() == openvdb::GRID_STAGGERED;
  return derive == Derive::hessian ? hessian(samples, to_index)
         : is_staggered            ? staggered_gradient(samples, to_index)
                                   : gradient(samples, to_index);
}

using Places = std::set<std::array<int, 3>>;

Places::value_type place_of(const Eigen::Vector3i& voxel, int doublings) {
  const Eigen::Vector3i place = voxel.unaryExpr([&](int i) { return i >> (3 + doublings); });
  return {place.x(), place.y(), place.z()};
}

/// The bricks of the level before that blocks refine.
Places refined_by(const std::vector<BlockShape>& shapes) {
  Places refined;
  for (const BlockShape& shape : shapes) refined.insert(place_of(shape.origin, 1));
  return refined;
}

/// Checks that the blocks of a level are where there is the level before. @param source  With the levels before.
void check_level(const std::filesystem::path& path, const BlockSource& source, const std::vector<BlockShape>& shapes) {
  const std::size_t level = source.finer.size() + 1;
  const std::string name = "level " + std::to_string(level) + " of the field";
  if (shapes.empty()) fail(path, name + " has no active voxel");
  const Eigen::AlignedBox3i voxels = active_box(source.shapes);  // A body may reach beyond, but not by a block.
  const Eigen::AlignedBox3i around(voxels.min().array() - TensorBlock::size, voxels.max().array() + TensorBlock::size);
  const Places refined = level > 1 ? refined_by(source.finer.back().shapes) : Places();
  for (const BlockShape& shape : shapes)
    if (level == 1 ? !around.contains(Eigen::Vector3i(shape.origin / 2))
                   : refined.count(place_of(shape.origin, 2)) == 0)
      fail(path, fmt::format("{} has voxels where there is no level {}, in the block at {} {} {}", name, level - 1,
                             shape.origin.x(), shape.origin.y(), shape.origin.z()));
}

/// Adds the finer levels of a field. @throw std::runtime_error if they do not fit to those before.
void add_levels(const std::filesystem::path& path, const VdbFile& file, const FieldGrids& field, BlockSource& source) {
  std::size_t bricks = source.shapes.size();
  for (const std::vector<FieldPart>& parts : field.finer) {
    const std::vector<FieldGrid> grids = field_grids_of(file, parts);
    const std::size_t level = source.finer.size() + 1;
    const Eigen::Affine3d right = to_world_of_level(source.to_world, static_cast<int>(level));
    if (!same_transform(right, common_transform(path, grids)))
      fail(path, fmt::format("grid {} must have the transform of level 0, with voxels of 1/{} of their size",
                             parts.front().grid, 1 << level));
    const std::size_t bytes = field.derive != Derive::none ? sizeof(SampleBlock) : min_brick_bytes;
    std::vector<BlockShape> shapes = find_blocks(path, grids, bytes);
    check_level(path, source, shapes);
    bricks += 8 * refined_by(shapes).size();
    require_memory(path, bricks, cubic_brick_bytes);
    source.finer.push_back({std::move(shapes), fill_of(path, grids)});
  }
}

/// The derived tensors of all levels, in memory.
BlockSource derived_source(const std::filesystem::path& path, const VdbFile& file, const FieldGrids& field,
                           const BlockSource& source) {
  const auto blocks_of_level = [&](std::size_t level, const auto& parts, const auto& shapes) {
    const Eigen::Affine3d to_world = to_world_of_level(source.to_world, static_cast<int>(level));
    return derived_blocks(path, field_grids_of(file, parts), field.derive, shapes, to_world.inverse().linear());
  };
  TensorGrid grid{source.name, source.to_world, {}, source.metadata, source.surface};
  grid.blocks = blocks_of_level(0, field.parts, source.shapes);
  for (std::size_t i = 0; i < field.finer.size(); ++i)
    grid.finer.push_back(blocks_of_level(i + 1, field.finer[i], source.finer[i].shapes));
  return source_of(std::move(grid));
}

/// The stress of the velocity gradients that a source has.
BlockSource stress_of(BlockSource source, float sign) {
  const auto stress = [sign](const Fill& fill) -> Fill {
    return [=](std::size_t i, TensorBlock& block) {
      fill(i, block);
      for (Eigen::Matrix3f& value : block.values) value = sign * viscous_stress(value);
    };
  };
  source.fill = stress(source.fill);
  for (BlockLevel& level : source.finer) level.fill = stress(level.fill);
  if (sign < 0 && source.metadata.erase(negated_key) == 0) source.metadata[negated_key] = "yes";
  return source;
}

/// Adds metadata to a grid, and keeps the grid's own entries: name, class, type, ...
void note(const std::map<std::string, std::string>& metadata, openvdb::MetaMap& grid) {
  for (const auto& [key, value] : metadata)
    if (!grid[key] && key != length_unit_key) grid.insertMeta(key, openvdb::StringMetadata(value));
}

[[noreturn]] void fail_too_large(const std::filesystem::path& path, const std::string& field) {
  fail(path, "the active voxels of \"" + field + "\" do not fit in memory; resample it more coarsely");
}

using RowLeaf = openvdb::Vec3STree::LeafNodeType;

RowLeaf row_leaf(const TensorBlock& block, int row) {
  RowLeaf leaf(coord_of(block.origin));
  for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
    if (!block.active[offset]) continue;
    const auto values = block.values[offset].row(row);
    leaf.setValueOn(static_cast<openvdb::Index>(offset), openvdb::Vec3s(values[0], values[1], values[2]));
  }
  return leaf;
}

/// One row of the tensors of a level of a grid, which must outlive it, as a grid of vectors: its leaves have masks, and
/// get their values when they are written, one at a time.
WrittenGrid row_grid(const TensorGrid& grid, std::size_t level, int row, bool is_half) {
  const auto result = empty_grid<openvdb::Vec3SGrid>();
  result->setName(grid.name + "_row" + std::to_string(row) + level_suffix(level));
  place(*result, to_world_of_level(grid.to_world, static_cast<int>(level)));
  result->setVectorType(openvdb::VEC_INVARIANT);
  result->setSaveFloatAsHalf(is_half);
  note(grid.metadata, *result);
  const TensorBlocks& blocks = *levels_of(grid)[level];
  std::unordered_map<const RowLeaf*, const TensorBlock*> block_of;
  const std::vector<BlockShape> shapes = shapes_of(blocks);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    auto* const leaf = new RowLeaf(openvdb::PartialCreate(), coord_of(shapes[i].origin));
    result->tree().addLeaf(leaf);  // The tree owns it.
    block_of.emplace(leaf, &blocks[i]);
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      leaf->setActiveState(static_cast<openvdb::Index>(offset), shapes[i].active[offset]);
  }
  auto write_values = [row, is_half, result, block_of = std::move(block_of)](std::ostream& file) {
    for (auto leaf = result->tree().cbeginLeaf(); leaf; ++leaf)
      row_leaf(*block_of.at(&*leaf), row).writeBuffers(file, is_half);
  };
  return {result, std::move(write_values), shapes.size() * RowLeaf::SIZE * sizeof(openvdb::Vec3s)};
}

void check_half_range(const std::filesystem::path& path, const TensorGrid& grid) {
  for (const TensorBlocks* blocks : levels_of(grid))
    tbb::parallel_for(std::size_t{0}, blocks->size(), [&](std::size_t i) {
      for (const Eigen::Matrix3f& value : (*blocks)[i].values)
        if ((value.array().abs() > max_half).any())
          fail(path, "a component exceeds 65504, the greatest 16-bit float; write single precision or scale the field");
    });
}

/// The first active voxel. @param grid  Of tensors, or numbers.
template <class Grid>
Eigen::Vector3i first_voxel(const Grid& grid) {
  for (const auto& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[static_cast<std::size_t>(offset)]) return block.origin + TensorBlock::position(offset);
  return {0, 0, 0};
}

openvdb::FloatGrid::Ptr float_grid(const ScalarGrid& grid) {
  const auto result = empty_grid<openvdb::FloatGrid>();
  for (const ScalarBlock& block : grid.blocks) {
    auto* leaf = new openvdb::FloatTree::LeafNodeType(coord_of(block.origin));
    result->tree().addLeaf(leaf);  // The tree owns it.
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset]) leaf->setValueOn(static_cast<openvdb::Index>(offset), block.values[offset]);
  }
  result->setName(grid.name);
  place(*result, grid.to_world);
  result->setGridClass(grid.fog ? openvdb::GRID_FOG_VOLUME : openvdb::GRID_UNKNOWN);
  note(grid.metadata, *result);
  return result;
}

}  // namespace

std::vector<GridInfo> list_vdb(const std::filesystem::path& path) { return infos_of(read_vdb(path)); }

BlockSource open_tensor_vdb(const std::filesystem::path& path, const std::string& name, Derive wanted,
                            const ComponentGrids& components) {
  const FieldGrids field = field_grids(path, list_vdb(path), name, wanted, components);
  const VdbFile file = read_vdb(path, grid_names(field));
  const std::vector<FieldGrid> grids = field_grids_of(file, field.parts);
  BlockSource result;
  result.name = field.name;
  result.to_world = common_transform(path, grids);
  result.metadata = metadata_of(file.metadata, *grids.front().file.grid);
  const bool derives = field.derive != Derive::none;
  if (derives) derive_unit(*grids.front().file.grid, field.derive, result.metadata);
  try {
    result.surface = read_surface(path, file, field.name, result.to_world);
    result.shapes = find_blocks(path, grids, derives ? sizeof(SampleBlock) : min_brick_bytes);
    if (result.shapes.empty()) fail(path, "\"" + result.name + "\" has no active voxel");
    add_levels(path, file, field, result);
    if (derives) result = derived_source(path, file, field, result);
  } catch (const std::bad_alloc&) {
    fail_too_large(path, result.name);
  }
  if (!derives) result.fill = fill_of(path, grids);
  if (is_stress(wanted)) result = stress_of(std::move(result), wanted == Derive::viscous_stress ? 1.0f : -1.0f);
  try {
    return with_mirror_image(std::move(result));
  } catch (const std::invalid_argument& error) {
    fail(path, error.what());
  }
}

TensorGrid read_tensor_vdb(const std::filesystem::path& path, const std::string& name, Derive derive,
                           const ComponentGrids& components) {
  const BlockSource source = open_tensor_vdb(path, name, derive, components);
  try {
    return to_grid(source);
  } catch (const std::bad_alloc&) {
    fail_too_large(path, source.name);
  }
}

void write_tensor_vdb(const std::filesystem::path& path, const TensorGrid& grid, bool is_half,
                      VdbCompression compression) {
  if (is_half) check_half_range(path, grid);
  std::vector<WrittenGrid> rows;
  for (std::size_t level = 0; level <= grid.finer.size(); ++level)
    for (int row = 0; row < 3; ++row) rows.push_back(row_grid(grid, level, row, is_half));
  for (const auto& part : surface_grids(grid.surface, grid.name, grid.to_world, first_voxel(grid)))
    rows.push_back({part});
  openvdb::MetaMap metadata;
  for (const auto& [key, value] : grid.metadata)
    if (key != length_unit_key) metadata.insertMeta(key, openvdb::StringMetadata(value));
  write_vdb(path, rows, metadata, compression);
}

void write_scalar_vdb(const std::filesystem::path& path, const std::vector<ScalarGrid>& grids,
                      const std::map<std::string, std::string>& metadata, const TriangleMesh& surface) {
  openvdb::MetaMap of_file;
  for (const auto& [key, value] : metadata) of_file.insertMeta(key, openvdb::StringMetadata(value));
  std::vector<WrittenGrid> all;
  for (const ScalarGrid& grid : grids) all.push_back({float_grid(grid)});
  for (const ScalarGrid& grid : grids)
    for (const auto& part : surface_grids(surface, grid.name, grid.to_world, first_voxel(grid))) all.push_back({part});
  write_vdb(path, all, of_file);
}

}  // namespace tensorray
