// Fields of several levels in OpenVDB files.

#include <functional>

#include <openvdb/openvdb.h>

#include "tests/volumes/file_support.h"
#include "tests/volumes/level_support.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/files/tensor_files.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

TensorGrid three_levels() {
  const auto refines = [](const Vector3i& brick) { return brick.x() == 0; };
  TensorGrid grid = grid_of_levels(
      {Vector3i(-8, 0, 0), Vector3i(16, 11, 8)}, 3, refines,
      [](const Vector3d& at) { return waves((4 * at).cast<int>()); }, sparse_grid().to_world);
  grid.name = "stress";
  grid.metadata = sparse_grid().metadata;
  return grid;
}

TEST(LevelFiles, AllLevelsComeBackAndHaveTheirVoxelSizes) {
  const TensorGrid grid = three_levels();
  const Temporary path("a.vdb"), again("b.vdb");
  write_tensor_vdb(path, grid);
  const TensorGrid read = read_tensor_vdb(path);
  ASSERT_EQ(read.finer.size(), 2u);
  for (std::size_t level = 0; level < 3; ++level) expect_same_blocks(*levels_of(read)[level], *levels_of(grid)[level]);
  EXPECT_EQ(read.name, "stress");
  write_tensor_vdb(again, read);
  EXPECT_EQ(bytes_of(path), bytes_of(again));
  EXPECT_EQ(list_vdb(path).size(), 9u);
  EXPECT_THAT(tensor_names(list_vdb(path)), ElementsAre("stress"));
  const auto at = [&](const char* name, const openvdb::Vec3d& index) {
    return stock_grid_of<openvdb::Vec3SGrid>(path, name)->indexToWorld(index);
  };
  EXPECT_LT((at("stress_row1@2", {4, 8, -12}) - at("stress_row1", {1, 2, -3})).length(), 1e-9);
  EXPECT_LT((at("stress_row0@1", {4, 8, -12}) - at("stress_row0", {2, 4, -6})).length(), 1e-9);
}

TEST(LevelFiles, HalfIsOfAllLevels) {
  TensorGrid grid = three_levels();
  const Temporary path("a.vdb");
  write_tensor_vdb(path, grid, true);
  for (const GridInfo& info : list_vdb(path)) EXPECT_EQ(info.storage, "half") << info.name;
  EXPECT_EQ(read_tensor_vdb(path).finer.size(), 2u);
  grid.finer[1][0].values.fill(Eigen::Matrix3f::Constant(70000));
  EXPECT_THROW(write_tensor_vdb(path, grid, true), std::runtime_error);
}

/// Appends the rows of a level, in which `set` sets voxels.
void add_rows(openvdb::GridPtrVec& grids, int level, double voxel_size,
              const std::function<void(openvdb::Vec3STree& tree)>& set, int count = 3) {
  for (int row = 0; row < count; ++row) {
    const auto grid = stock_grid<openvdb::Vec3SGrid>("T_row" + std::to_string(row) + level_suffix(level));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel_size));
    set(grid->tree());
    grids.push_back(grid);
  }
}

void fill_from(openvdb::Vec3STree& tree, int first, int last) {
  tree.fill({{first, 0, 0}, {last, 15, 15}}, openvdb::Vec3s(1));
  tree.voxelizeActiveTiles();
}

TEST(LevelFiles, DamagedLevelsAreRefusedInOneLine) {
  struct Damage {
    const char* name;
    std::function<void(openvdb::GridPtrVec& grids)> change;
    const char* message;
  };
  const auto half = [](openvdb::Vec3STree& tree) { fill_from(tree, 0, 15); };
  const Damage table[] = {
      {"rows are missing", [=](auto& grids) { add_rows(grids, 1, 0.5, half, 2); },
       "level 1 of the field lacks grid T_row2@1"},
      {"a wrong voxel size", [=](auto& grids) { add_rows(grids, 1, 0.25, half); }, "voxels of 1/2 of their size"},
      {"the voxel size of level 0", [=](auto& grids) { add_rows(grids, 1, 1, half); }, "grid T_row0@1 must have"},
      {"a level is missing", [=](auto& grids) { add_rows(grids, 2, 0.25, half); }, "no level 1"},
      {"no voxel", [](auto& grids) { add_rows(grids, 1, 0.5, [](auto&) {}); },
       "level 1 of the field has no active voxel"},
      {"beyond level 0", [](auto& grids) { add_rows(grids, 1, 0.5, [](auto& tree) { fill_from(tree, 64, 79); }); },
       "where there is no level 0"},
      {"beside level 1",
       [=](auto& grids) {
         add_rows(grids, 1, 0.5, half);
         add_rows(grids, 2, 0.25, [](auto& tree) { fill_from(tree, 32, 47); });
       },
       "where there is no level 1"},
      {"a fifth level",
       [=](auto& grids) {
         for (int level = 1; level < 5; ++level) add_rows(grids, level, std::pow(0.5, level), half);
       },
       "4 at most"},
      {"another type",
       [=](auto& grids) {
         add_rows(grids, 1, 0.5, half, 2);
         grids.push_back(stock_grid_of_type("float", "T_row2@1"));
       },
       "T_row2@1 is float"},
  };
  const Temporary path("a.vdb");
  for (const Damage& damage : table) {
    openvdb::GridPtrVec grids;
    add_rows(grids, 0, 1, [](auto& tree) { fill_from(tree, 0, 15); });
    damage.change(grids);
    write_stock(path, grids);
    EXPECT_THAT(message([&] { open_tensor_vdb(path); }), AllOf(HasSubstr(path.string()), HasSubstr(damage.message)))
        << damage.name;
  }
}

/// Gradients are taken at the voxels of each level: those of a quadratic velocity are exact.
TEST(LevelFiles, GradientsAreOfEachLevel) {
  const Temporary path("a.vdb");
  openvdb::GridPtrVec grids;
  for (int level = 0; level < 2; ++level) {
    const double size = std::pow(0.5, level);
    const auto grid = stock_grid<openvdb::Vec3SGrid>("U" + level_suffix(level));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(size));
    for (int x = 0; x <= (level == 0 ? 16 : 15); ++x)
      for (int y = 0; y <= 16 << level; ++y)
        for (int z = 0; z <= 16 << level; ++z)
          grid->tree().setValue({x, y, z}, openvdb::Vec3s(float(size * x * size * x), float(size * y), 0));
    grids.push_back(grid);
  }
  write_stock(path, grids);
  const TensorField field(open_tensor_vdb(path, "", Derive::gradient), {Interpolation::cubic});
  EXPECT_EQ(field.levels(), 2);
  TensorSampler sampler(field);
  for (const double x : {0.3, 4.7, 7.9, 9.2, 14.3}) {
    const Matrix3d gradient = Vector3d(2 * x, 1, 0).asDiagonal();
    EXPECT_LT((sampler.at(Vector3d(x, 5.3, 4.1)) - gradient).norm(), 2e-4) << x;
  }
}

}  // namespace
}  // namespace tensorray
