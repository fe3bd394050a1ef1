#pragma once
/// @file tests/volumes/file_support.h
/// Temporary files, a tensor grid with everything that files must keep, and grids that OpenVDB itself writes.

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <unistd.h>

#include "tests/volumes/file_size_limit.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// A path in the tests' temporary folder that no other process uses; the destructor removes the file.
class Temporary : public std::filesystem::path {
 public:
  explicit Temporary(const std::string& name) : path(testing::TempDir()) {
    *this /= "tensorray_" + std::to_string(::getpid()) + "_" + name;
  }
  ~Temporary() { std::filesystem::remove_all(*this); }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
};

inline std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Non-symmetric values, with holes, negative indices, and a sheared transform.
inline TensorGrid sparse_grid() {
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();
  to_world.matrix() << 0.5, 0.1, 0, 3, -0.1, 0.25, 0.05, -7, 0, 0.3, 0.125, 11, 0, 0, 0, 1;
  TensorGrid grid = dense_grid({Eigen::Vector3i(-11, -3, 5), Eigen::Vector3i(6, 12, 21)}, to_world,
                               [](const Eigen::Vector3i& i) -> Eigen::Matrix3d {
                                 return Eigen::Matrix3d::NullaryExpr([&](Eigen::Index r, Eigen::Index c) {
                                   const double at = 2.1 * static_cast<double>(r) + 0.9 * static_cast<double>(c);
                                   return std::sin(1.3 * i.x() + 0.7 * i.y() + 0.2 * i.z() + at);
                                 });
                               });
  for (TensorBlock& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; offset += 5) {
      block.active.reset(offset);
      block.values[offset].setZero();
    }
  grid.name = "stress";
  grid.metadata = {{"tensorray:field", "stress"}, {"tensorray:units", "Pa/m"}, {"tensorray:source", "a test"}};
  return grid;
}

inline void expect_same_blocks(const TensorGrid& a, const TensorGrid& b) {
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  for (std::size_t i = 0; i < a.blocks.size(); ++i) {
    EXPECT_EQ(a.blocks[i].origin, b.blocks[i].origin);
    EXPECT_EQ(a.blocks[i].active, b.blocks[i].active);
    EXPECT_EQ(a.blocks[i].values, b.blocks[i].values);
  }
}

inline const Eigen::Matrix3f* find(const TensorGrid& grid, const Eigen::Vector3i& index) {
  for (const TensorBlock& block : grid.blocks) {
    const Eigen::Vector3i p = index - block.origin;
    if ((p.array() < 0).any() || (p.array() > 7).any()) continue;
    const int offset = TensorBlock::offset(p.x(), p.y(), p.z());
    return block.active[offset] ? &block.values[offset] : nullptr;
  }
  return nullptr;
}

template <class Grid>
typename Grid::Ptr stock_grid(const std::string& name, typename Grid::ValueType background) {
  openvdb::initialize();
  const auto grid = Grid::create(background);
  grid->setName(name);
  return grid;
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
