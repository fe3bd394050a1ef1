// The surface of a body in a field's file.

#include <random>

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
TriangleMesh random_surface(std::size_t points, std::size_t triangles) {
  std::mt19937 random(static_cast<unsigned>(points));
  std::normal_distribution<double> normal(0, 100);
  TriangleMesh mesh;
  for (std::size_t i = 0; i < points; ++i) {
    const double x = normal(random), y = normal(random), z = normal(random);
    mesh.vertices.emplace_back(x, y, z);
  }
  const auto number = [&] { return static_cast<std::uint32_t>(random() % points); };
  for (std::size_t i = 0; i < triangles; ++i) {
    const std::uint32_t a = number(), b = number();
    mesh.triangles.push_back({a, b, number()});
  }
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
  const std::pair<std::size_t, std::size_t> sizes[] = {{1, 1}, {4, 4}, {256, 257}, {5000, 9999}, {100000, 70000}};
  for (const auto& [points, triangles] : sizes)
    for (const bool half : {false, true}) {
      const TensorGrid grid = grid_with(random_surface(points, triangles));
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

/// The rows keep their bytes; programs that draw all grids find the others within the field.
TEST(SurfaceGrids, DisturbNoOtherReader) {
  const Temporary path("a.vdb"), without("b.vdb");
  const TensorGrid grid = grid_with(random_surface(900, 2000));
  write_tensor_vdb(path, grid);
  write_tensor_vdb(without, grid_with({}));
  EXPECT_EQ(list_vdb(without).size(), 3u);
  EXPECT_EQ(tensor_names(list_vdb(path)), std::vector<std::string>{"stress"});
  Eigen::AlignedBox3d voxels;
  for (const auto& one : stock_grids(path)) {
    ASSERT_TRUE(one->isType<openvdb::Vec3SGrid>()) << "the type that Python's module has: " << one->getName();
    const openvdb::CoordBBox box = one->evalActiveVoxelBoundingBox();
    if (one->getName().find("_row") != std::string::npos) {
      voxels.extend(Eigen::Vector3d(box.min().x(), box.min().y(), box.min().z()));
      voxels.extend(Eigen::Vector3d(box.max().x(), box.max().y(), box.max().z()));
      continue;
    }
    for (const openvdb::Coord& corner : {box.min(), box.max()}) {
      const openvdb::Vec3d at = one->indexToWorld(corner);
      EXPECT_TRUE(voxels.contains(grid.to_world.inverse() * Eigen::Vector3d(at.x(), at.y(), at.z())));
    }
  }
}

TEST(SurfaceGrids, EachFieldOfAFileHasItsOwn) {
  const Temporary one("a.vdb"), other("b.vdb"), path("c.vdb");
  const TensorGrid a = grid_with(random_surface(9, 14), "a"), b = grid_with(random_surface(700, 30), "b");
  write_tensor_vdb(one, a);
  write_tensor_vdb(other, b);
  openvdb::GridPtrVec all = stock_grids(one);
  for (const auto& grid : stock_grids(other)) all.push_back(grid);
  for (const auto& grid : voxel_rows("c")) all.push_back(grid);
  all.push_back(stock_grid<openvdb::Vec3SGrid>("velocity", openvdb::Vec3s(0)));
  openvdb::gridPtrCast<openvdb::Vec3SGrid>(all.back())->tree().setValue({0, 0, 0}, {1, 2, 3});
  write_stock(path, all);
  expect_same_surface(read_tensor_vdb(path, "a").surface, a.surface);
  expect_same_surface(read_tensor_vdb(path, "b").surface, b.surface);
  EXPECT_TRUE(read_tensor_vdb(path, "c").surface.triangles.empty());
  EXPECT_TRUE(read_tensor_vdb(path, "velocity", Derive::gradient).surface.triangles.empty());
}

/// Grids of numbers keep it, and so do tensors that are derived of them.
TEST(SurfaceGrids, DerivedFieldsKeepIt) {
  const Temporary path("a.vdb");
  ScalarGrid numbers;
  numbers.name = "norm";
  numbers.blocks.resize(1);
  numbers.blocks[0].active.set();
  const TriangleMesh surface = random_surface(8, 12);
  write_scalar_vdb(path, {numbers}, {}, surface);
  expect_same_surface(read_tensor_vdb(path, "", Derive::hessian).surface, surface);
}

TEST(SurfaceGrids, DamageIsOneLineThatNamesTheFile) {
  const Temporary path("a.vdb"), damaged("b.vdb");
  write_tensor_vdb(path, grid_with(random_surface(300, 600)));
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
