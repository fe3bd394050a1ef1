#pragma once
/// Temporary files, a tensor grid with everything that files must keep, and grids that OpenVDB itself writes.

#include <tuple>

#include "tests/files.h"
#include "tests/volumes/grid_support.h"
#include "volumes/files/tensor_files.h"
#include "volumes/vdb/vdb_archive.h"

namespace tensorray {

/// Non-symmetric values, with holes, negative indices, and a sheared transform.
inline TensorGrid sparse_grid() {
  TensorGrid grid = dense_grid({Eigen::Vector3i(-11, -3, 5), Eigen::Vector3i(6, 12, 21)}, sheared_transform(), waves);
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

template <class T>
Eigen::Matrix<T, 3, 1> to_eigen(const openvdb::math::Vec3<T>& v) {
  return {v[0], v[1], v[2]};
}

inline openvdb::Coord coord_of(const Eigen::Vector3i& index) { return openvdb::Coord(index.data()); }

/// An empty grid of a type that OpenVDB makes by its name, so that it is not compiled here.
inline openvdb::GridBase::Ptr stock_grid_of_type(const std::string& type, const std::string& name) {
  openvdb::initialize();
  const auto grid = openvdb::GridBase::createGrid("Tree_" + type + "_5_4_3");
  grid->setName(name);
  return grid;
}

/// The rows of a tensor: `set(grid, row)` sets their voxels.
template <class Grid = openvdb::Vec3SGrid, class Set>
openvdb::GridPtrVec stock_rows(const std::string& name, const Set& set) {
  openvdb::GridPtrVec rows;
  for (int row = 0; row < 3; ++row) {
    const auto grid = stock_grid<Grid>(name + "_row" + std::to_string(row));
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
                        std::uint32_t compression = openvdb::io::Archive::DEFAULT_COMPRESSION_FLAGS) {
  openvdb::io::File file(path.string());
  file.setCompression(compression);
  file.write(grids);
}

/// What is read of a file of grids that OpenVDB itself writes.
inline TensorGrid read_stock(const openvdb::GridPtrVec& grids, const std::string& name = "",
                             Derive derive = Derive::none) {
  const Temporary path("stock.vdb");
  write_stock(path, grids);
  return read_tensor_vdb(path, name, derive);
}

/// What a TensorGrid promises (tensor_grid.h), whatever the file says.
inline void expect_sound(const TensorGrid& grid) {
  const Eigen::Vector3i* before = nullptr;
  for (const TensorBlock& block : grid.blocks) {
    EXPECT_TRUE(block.active.any());
    EXPECT_TRUE(block.origin.unaryExpr([](int i) { return i & (TensorBlock::size - 1); }).isZero());
    const auto key = [](const Eigen::Vector3i& at) { return std::make_tuple(at.x(), at.y(), at.z()); };
    EXPECT_TRUE(!before || key(*before) < key(block.origin));
    before = &block.origin;
    bool is_zero_elsewhere = true;
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      is_zero_elsewhere = is_zero_elsewhere && (block.active[offset] || block.values[offset].isZero(0));
    EXPECT_TRUE(is_zero_elsewhere) << block.origin.transpose();
  }
}

/// Matches what throws a std::runtime_error of one line that has all of these words.
template <class... Words>
auto fails_with(const Words&... words) {
  return ThrowsMessage<std::runtime_error>(AllOf(Not(HasSubstr("\n")), HasSubstr(words)...));
}

}  // namespace tensorray
