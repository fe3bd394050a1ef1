#pragma once
/// Temporary files, a tensor grid with everything that files must keep, and grids that OpenVDB itself writes.

#include "tests/files.h"
#include "tests/volumes/grid_support.h"
#include "volumes/vdb/vdb_archive.h"

namespace tensorray {

/// Non-symmetric values, with holes, negative indices, and a sheared transform.
inline TensorGrid sparse_grid() {
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();
  to_world.matrix() << 0.5, 0.1, 0, 3, -0.1, 0.25, 0.05, -7, 0, 0.3, 0.125, 11, 0, 0, 0, 1;
  TensorGrid grid = dense_grid({Eigen::Vector3i(-11, -3, 5), Eigen::Vector3i(6, 12, 21)}, to_world, waves);
  clear_voxels(grid.blocks, [](const Eigen::Vector3i& index) {
    const Eigen::Vector3i in_block = index.unaryExpr([](int i) { return i & 7; });
    return TensorBlock::offset(in_block.x(), in_block.y(), in_block.z()) % 5 == 0;
  });
  grid.name = "stress";
  grid.metadata = {{"tensorray:field", "stress"}, {"tensorray:units", "Pa/m"}, {"tensorray:source", "a test"}};
  return grid;
}

template <class Grid>
typename Grid::Ptr stock_grid(const std::string& name) {
  const auto grid = empty_grid<Grid>();
  grid->setName(name);
  return grid;
}

/// An empty grid of a type that OpenVDB makes by its name, so that it is not compiled here.
inline openvdb::GridBase::Ptr stock_grid_of_type(const std::string& type, const std::string& name) {
  openvdb::initialize();
  const auto grid = openvdb::GridBase::createGrid("Tree_" + type + "_5_4_3");
  grid->setName(name);
  return grid;
}

/// The rows of a tensor: `set(grid, row)` sets their voxels.
template <class Set>
openvdb::GridPtrVec stock_rows(const std::string& name, const Set& set) {
  openvdb::GridPtrVec rows;
  for (int row = 0; row < 3; ++row) {
    const auto grid = stock_grid<openvdb::Vec3SGrid>(name + "_row" + std::to_string(row));
    set(*grid, row);
    rows.push_back(grid);
  }
  return rows;
}

/// Rows with one voxel, at the origin.
inline openvdb::GridPtrVec voxel_rows(const std::string& name, float value = 1) {
  return stock_rows(name, [&](auto& grid, int) { grid.tree().setValue({0, 0, 0}, openvdb::Vec3s(value)); });
}

/// All grids of a file, as OpenVDB itself reads them.
inline openvdb::GridPtrVec stock_grids(const std::filesystem::path& path) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(/*delayLoad=*/false);
  return *file.getGrids();
}

template <class Grid>
typename Grid::Ptr stock_grid_of(const std::filesystem::path& path, const std::string& name) {
  for (const auto& grid : stock_grids(path))
    if (grid->getName() == name) return openvdb::gridPtrCast<Grid>(grid);
  return nullptr;
}

inline void write_stock(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
                        std::uint32_t compression) {
  openvdb::io::File file(path.string());
  file.setCompression(compression);
  file.write(grids);
}

inline void write_stock(const std::filesystem::path& path, const openvdb::GridPtrVec& grids) {
  write_stock(path, grids, openvdb::io::Archive::DEFAULT_COMPRESSION_FLAGS);
}

}  // namespace tensorray
