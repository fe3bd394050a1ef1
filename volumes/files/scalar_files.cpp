#include "volumes/files/scalar_files.h"

#include "volumes/vdb/vdb_archive.h"
#include "volumes/vdb/vdb_transform.h"

namespace tensorray {
namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;
static_assert(Leaf::DIM == TensorBlock::size, "leaves are blocks");

openvdb::FloatGrid::Ptr float_grid(const ScalarGrid& grid) {
  const auto result = openvdb::FloatGrid::create();
  for (const ScalarBlock& block : grid.blocks) {
    auto* leaf = new Leaf(openvdb::Coord(block.origin.x(), block.origin.y(), block.origin.z()));
    result->tree().addLeaf(leaf);  // The tree owns it.
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset]) leaf->setValueOn(static_cast<openvdb::Index>(offset), block.values[offset]);
  }
  result->setName(grid.name);
  place(*result, grid.to_world);
  result->setGridClass(grid.fog ? openvdb::GRID_FOG_VOLUME : openvdb::GRID_UNKNOWN);
  for (const auto& [key, value] : grid.metadata)
    if (!(*result)[key])
      result->insertMeta(key, openvdb::StringMetadata(value));  // Keep the grid's own entries: name, class, ...
  return result;
}

}  // namespace

void write_scalar_vdb(const std::filesystem::path& path, const std::vector<ScalarGrid>& grids,
                      const std::map<std::string, std::string>& metadata) {
  openvdb::initialize();
  openvdb::MetaMap of_file;
  for (const auto& [key, value] : metadata) of_file.insertMeta(key, openvdb::StringMetadata(value));
  openvdb::GridPtrVec all;
  for (const ScalarGrid& grid : grids) all.push_back(float_grid(grid));
  write_vdb(path, all, of_file);
}

}  // namespace tensorray
