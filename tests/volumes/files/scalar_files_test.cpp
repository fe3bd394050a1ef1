// Invariants of a field as float grids, read back by OpenVDB itself.

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include "tests/volumes/file_support.h"
#include "volumes/files/tensor_files.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

openvdb::FloatGrid::Ptr read_stock(const std::filesystem::path& path, const std::string& name) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open();
  return openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid(name));
}

std::string text(const openvdb::MetaMap& metadata, const std::string& key) {
  return metadata.getMetadata<openvdb::StringMetadata>(key)->value();
}

TEST(ScalarFiles, HoldTheInvariantAtEachActiveVoxelOfTheField) {
  const TensorGrid field = sparse_grid();
  const Temporary path("a.vdb");
  write_scalar_vdb(path, {invariant_grid(Invariant::norm, field), invariant_grid(Invariant::mode, field)},
                   {{"tensorray:source", "a test"}});
  for (const Invariant which : {Invariant::norm, Invariant::mode}) {
    const auto grid = read_stock(path, invariant_names()[static_cast<std::size_t>(which)]);
    ASSERT_TRUE(grid);
    EXPECT_EQ(grid->activeVoxelCount(), field.active_voxels());
    EXPECT_EQ(grid->background(), 0);
    for (auto voxel = grid->cbeginValueOn(); voxel; ++voxel) {
      const openvdb::Coord at = voxel.getCoord();
      const Eigen::Matrix3f* tensor = find(field, {at.x(), at.y(), at.z()});
      ASSERT_TRUE(tensor);
      ASSERT_EQ(*voxel, static_cast<float>(invariant(which, tensor->cast<double>())));
    }
  }
}

TEST(ScalarFiles, HaveTheFieldsTransformAndTheInvariantsUnits) {
  const TensorGrid field = sparse_grid();
  const Temporary path("a.vdb");
  write_scalar_vdb(path,
                   {invariant_grid(Invariant::trace, field), invariant_grid(Invariant::determinant, field),
                    invariant_grid(Invariant::fractional_anisotropy, field)},
                   {});
  const auto grid = read_stock(path, "trace");
  const Vector3d expected = field.to_world * Vector3d(3, -2, 7);
  const openvdb::Vec3d world = grid->indexToWorld(openvdb::Vec3d(3, -2, 7));
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(world[axis], expected[axis], 1e-12);
  EXPECT_EQ(text(*grid, "tensorray:units"), "Pa/m");
  EXPECT_EQ(text(*grid, "tensorray:field"), "stress");
  EXPECT_EQ(text(*read_stock(path, "determinant"), "tensorray:units"), "(Pa/m)^3");
  EXPECT_EQ(text(*read_stock(path, "fractional_anisotropy"), "tensorray:units"), "1");
}

TEST(ScalarFiles, FogIsAFogVolumeForOtherPrograms) {
  ScalarGrid grid;
  grid.name = "smoke";
  grid.fog = true;
  grid.blocks.resize(1);
  grid.blocks[0].origin = {-8, 0, 16};
  grid.blocks[0].active.set(TensorBlock::offset(1, 2, 3));
  grid.blocks[0].values[TensorBlock::offset(1, 2, 3)] = 0.5f;
  const Temporary path("a.vdb");
  write_scalar_vdb(path, {grid}, {{"tensorray:version", "1"}});
  const auto read = read_stock(path, "smoke");
  EXPECT_EQ(read->getGridClass(), openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(read->activeVoxelCount(), 1u);
  EXPECT_EQ(read->getConstAccessor().getValue(openvdb::Coord(-7, 2, 19)), 0.5f);
  openvdb::io::File file(path.string());
  file.open();
  EXPECT_EQ(text(*file.getMetadata(), "tensorray:version"), "1");
}

TEST(ScalarFiles, ValuesBeyondSinglePrecisionBecomeItsEnd) {
  const TensorGrid field = dense_grid(
      {Vector3i(0, 0, 0), Vector3i(0, 0, 0)}, Eigen::Affine3d::Identity(),
      [](const Vector3i&) { return Eigen::Matrix3d(1e20 * Vector3d(-1, 1, 1).asDiagonal().toDenseMatrix()); });
  EXPECT_EQ(invariant_grid(Invariant::determinant, field).blocks[0].values[0], std::numeric_limits<float>::lowest());
}

}  // namespace
}  // namespace tensorray
