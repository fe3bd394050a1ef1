#include "volumes/files/stored_field.h"

#include <array>
#include <tuple>

#include <openvdb/Exceptions.h>
#include <tbb/parallel_sort.h>

#include "volumes/files/vdb_archive.h"

namespace tensorray {
namespace {

/// The last of the leaves that follow that of a block in the file and belong to the blocks that follow it: these are
/// read at once. Neighbours along z are also neighbours in the file.
const StoredLeaf& last_of_run(const StoredField& field, std::size_t block, std::size_t grid) {
  constexpr std::size_t longest = 16;
  std::uint32_t leaf = field.leaf(block, grid);
  while (++block % longest != 0 && block < field.block_count() && field.leaf(block, grid) == leaf + 1) ++leaf;
  return field.grids[grid].leaves[leaf];
}

void read_leaves(const StoredField& field, std::size_t i, std::vector<LeafReader>& readers, TensorBlock& block) {
  std::array<const float*, 3> rows{};
  std::size_t whole_rows = 0;
  const std::size_t count = field.grids.size();
  for (std::size_t grid = 0; grid < count; ++grid) {
    if (field.leaf(i, grid) == StoredField::missing) continue;
    const StoredLeaf& leaf = field.leaf_of(i, grid);
    LeafReader& reader = readers[grid];
    if (!reader.has(leaf)) reader.fetch(leaf, last_of_run(field, i, grid));
    reader.unpack(leaf);
    if (count == rows.size() && (rows[grid] = reader.vectors(leaf))) ++whole_rows;
  }
  if (whole_rows == rows.size()) return put_rows(rows, block);
  block.values.fill(Eigen::Matrix3f::Zero());  // A voxel of the block may be active in some of the grids alone.
  for (std::size_t grid = 0; grid < count; ++grid)
    if (field.leaf(i, grid) != StoredField::missing)
      readers[grid].put(field.leaf_of(i, grid), field.grids[grid].entries, block);
}

}  // namespace

std::vector<BlockShape> find_blocks(StoredField& field) {
  struct Place {
    Eigen::Vector3i origin;
    std::uint32_t grid, leaf;
  };
  std::vector<Place> places;
  for (std::size_t grid = 0; grid < field.grids.size(); ++grid)
    for (std::size_t leaf = 0; leaf < field.grids[grid].leaves.size(); ++leaf)
      if (const StoredLeaf& stored = field.grids[grid].leaves[leaf]; stored.active.any())
        places.push_back({stored.origin, static_cast<std::uint32_t>(grid), static_cast<std::uint32_t>(leaf)});
  tbb::parallel_sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    const auto key = [](const Place& place) {
      return std::make_tuple(place.origin.x(), place.origin.y(), place.origin.z(), place.grid, place.leaf);
    };
    return key(a) < key(b);
  });
  std::vector<BlockShape> shapes;
  for (const Place& place : places) {
    if (shapes.empty() || shapes.back().origin != place.origin) {
      shapes.push_back({place.origin, {}});
      field.leaves.resize(field.leaves.size() + field.grids.size(), StoredField::missing);
    }
    shapes.back().active |= field.grids[place.grid].leaves[place.leaf].active;
    field.leaves[field.leaves.size() - field.grids.size() + place.grid] = place.leaf;
  }
  return shapes;
}

void fill_block(const StoredField& field, std::size_t i, TensorBlock& block) {
  std::vector<LeafReader>& readers = field.readers.local();
  if (readers.empty())
    for (const StoredField::Grid& grid : field.grids) readers.emplace_back(field.file, grid.tree);
  try {
    read_leaves(field, i, readers, block);
  } catch (const Misfit&) {
    fail_damaged_voxels(field.path);
  } catch (const openvdb::Exception&) {
    fail_damaged_voxels(field.path);
  }
}

}  // namespace tensorray
