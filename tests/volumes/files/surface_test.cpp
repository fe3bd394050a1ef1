// The surface of a body in a field's file.

#include <cmath>
#include <cstdint>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include "tests/volumes/file_support.h"
#include "volumes/files/tensor_files.h"

namespace tensorray {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// Any triangles: files do not ask whether they are closed.
TriangleMesh any_surface(std::uint32_t points, std::uint32_t triangles) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < points; ++i)
    mesh.vertices.emplace_back(std::sin(i), 100 * std::cos(1.3 * i), 7.0 / (i + 1));
  for (std::uint32_t i = 0; i < triangles; ++i)
    mesh.triangles.push_back({i % points, (7 * i + 1) % points, (points - 1) * (i + 1) % points});
  return mesh;
}

void expect_same_surface(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_EQ(a.triangles, b.triangles);
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  for (std::size_t i = 0; i < a.vertices.size(); ++i) EXPECT_LT((a.vertices[i] - b.vertices[i]).norm(), 1e-10);
}

TensorGrid grid_with(const TriangleMesh& surface, const std::string& name = "stress") {
  TensorGrid grid = sparse_grid();
  grid.surface = surface;
  grid.name = name;
  return grid;
}

/// The grids of a file, as OpenVDB reads them.
openvdb::GridPtrVec stock_grids(const std::filesystem::path& path) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open();
  openvdb::GridPtrVec grids;
  for (auto name = file.beginName(); name != file.endName(); ++name) grids.push_back(file.readGrid(*name));
  return grids;
}

TEST(SurfaceGrids, KeepAllPointsAndTriangles) {
  const std::pair<std::uint32_t, std::uint32_t> sizes[] = {{1, 1}, {4, 4}, {256, 257}, {5000, 9999}, {100000, 70000}};
  for (const auto& [points, triangles] : sizes)
    for (const bool half : {false, true}) {
      const TensorGrid grid = grid_with(any_surface(points, triangles));
      const Temporary path("a.vdb"), again("b.vdb");
      write_tensor_vdb(path, grid, half);
      const TensorGrid read = read_tensor_vdb(path);
      expect_same_surface(read.surface, grid.surface);
      EXPECT_EQ(read.name, "stress");
      if (half) continue;
      write_tensor_vdb(again, grid);
      EXPECT_TRUE(bytes_of(path) == bytes_of(again));
    }
}

/// Programs that draw all grids find the others within the field.
TEST(SurfaceGrids, DisturbNoOtherReader) {
  const Temporary path("a.vdb");
  const TensorGrid grid = grid_with(any_surface(900, 2000));
  write_tensor_vdb(path, grid);
  EXPECT_EQ(tensor_names(list_vdb(path)), std::vector<std::string>{"stress"});
  const Eigen::AlignedBox3d voxels(grid.active_box().min().cast<double>(), grid.active_box().max().cast<double>());
  for (const auto& one : stock_grids(path)) {
    ASSERT_TRUE(one->isType<openvdb::Vec3SGrid>()) << "the type that Python's module has: " << one->getName();
    const openvdb::CoordBBox box = one->evalActiveVoxelBoundingBox();
    for (const openvdb::Coord& corner : {box.min(), box.max()}) {
      const openvdb::Vec3d at = one->indexToWorld(corner);
      const Eigen::Vector3d index = grid.to_world.inverse() * Eigen::Vector3d(at.x(), at.y(), at.z());
      EXPECT_LT(voxels.exteriorDistance(index), 1e-9) << one->getName();
    }
  }
}

/// Fields of a file, those that are derived of its grids, and grids of numbers.
TEST(SurfaceGrids, EachFieldOfAFileHasItsOwn) {
  const Temporary paths[] = {Temporary("a.vdb"), Temporary("b.vdb"), Temporary("c.vdb")}, path("d.vdb");
  const TensorGrid a = grid_with(any_surface(9, 14), "a"), b = grid_with(any_surface(700, 30), "b");
  write_tensor_vdb(paths[0], a);
  write_tensor_vdb(paths[1], b);
  ScalarGrid numbers;
  numbers.name = "norm";
  numbers.blocks.resize(1);
  numbers.blocks[0].active.set();
  write_scalar_vdb(paths[2], {numbers}, {}, a.surface);
  openvdb::GridPtrVec all = voxel_rows("c");
  for (const Temporary& each : paths)
    for (const auto& grid : stock_grids(each)) all.push_back(grid);
  all.push_back(voxel_rows("velocity").front());
  write_stock(path, all);
  expect_same_surface(read_tensor_vdb(path, "a").surface, a.surface);
  expect_same_surface(read_tensor_vdb(path, "b").surface, b.surface);
  expect_same_surface(read_tensor_vdb(path, "", Derive::hessian).surface, a.surface);
  EXPECT_TRUE(read_tensor_vdb(path, "c").surface.triangles.empty());
  EXPECT_TRUE(read_tensor_vdb(path, "velocity_row0", Derive::gradient).surface.triangles.empty());
}

TEST(SurfaceGrids, DamageIsOneLineThatNamesTheFile) {
  const Temporary path("a.vdb"), damaged("b.vdb");
  write_tensor_vdb(path, grid_with(any_surface(300, 600)));
  const auto refuses = [&](const openvdb::GridPtrVec& grids, const std::string& what) {
    write_stock(damaged, grids);
    EXPECT_THAT(
        [&] { read_tensor_vdb(damaged); },
        ThrowsMessage<std::runtime_error>(AllOf(HasSubstr(damaged.string()), HasSubstr("surface"), HasSubstr(what))));
  };
  for (const char* missing : {"stress_surface_points", "stress_surface_triangles"}) {
    openvdb::GridPtrVec grids = stock_grids(path);
    grids.erase(std::remove_if(grids.begin(), grids.end(), [&](const auto& g) { return g->getName() == missing; }),
                grids.end());
    refuses(grids, missing + std::string(" is missing"));
  }
  const auto with_value = [&](const std::string& name, const openvdb::Vec3s& value) {
    openvdb::GridPtrVec grids = stock_grids(path);
    for (const auto& grid : grids)
      if (grid->getName() == name) openvdb::gridPtrCast<openvdb::Vec3SGrid>(grid)->tree().setValue({0, 0, 0}, value);
    return grids;
  };
  refuses(with_value("stress_surface_triangles", {0, 1, 300}), "not there");
  refuses(with_value("stress_surface_triangles", {0, -1, 2}), "not there");
  refuses(with_value("stress_surface_triangles", {0, 1.5, 2}), "not there");
  refuses(with_value("stress_surface_points", {0, 1, std::numeric_limits<float>::quiet_NaN()}), "finite");
}

}  // namespace
}  // namespace tensorray
