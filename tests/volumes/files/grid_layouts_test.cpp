#include "volumes/files/grid_layouts.h"

#include <cstdint>

#include <openvdb/openvdb.h>

#include "tests/volumes/file_support.h"
#include "volumes/files/tensor_files.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {
namespace {

std::vector<GridInfo> scalars(const std::vector<std::string>& names) {
  std::vector<GridInfo> grids;
  for (const std::string& name : names) grids.push_back({name, "float", "full"});
  return grids;
}

/// The tensor whose entry of the i-th grid of `names` is i + 1.
Matrix3d numbered(const FieldGrids& field, const std::vector<std::string>& names) {
  Matrix3d tensor = Matrix3d::Zero();
  for (const FieldPart& part : field.parts)
    for (const TensorEntry& entry : part.entries)
      tensor(entry.row, entry.column) =
          static_cast<double>(std::find(names.begin(), names.end(), part.grid) - names.begin()) + 1;
  return tensor;
}

TEST(GridLayouts, ComponentsAreFoundByTheirNames) {
  const Matrix3d symmetric = by_rows({1, 2, 3, 2, 4, 5, 3, 5, 6});
  const Matrix3d rows = by_rows({1, 2, 3, 4, 5, 6, 7, 8, 9});
  const std::vector<std::pair<std::vector<std::string>, Matrix3d>> cases = {
      {{"s.xx", "s.xy", "s.xz", "s.yy", "s.yz", "s.zz"}, symmetric},
      {{"sxx", "sxy", "sxz", "syy", "syz", "szz"}, symmetric},
      {{"s_xx", "s_xy", "s_xz", "s_yy", "s_yz", "s_zz"}, symmetric},
      {{"sXX", "sXY", "sXZ", "sYY", "sYZ", "sZZ"}, symmetric},
      {{"s11", "s12", "s13", "s22", "s23", "s33"}, symmetric},
      {{"s_11", "s_12", "s_13", "s_22", "s_23", "s_33"}, symmetric},
      {{"s00", "s01", "s02", "s11", "s12", "s22"}, symmetric},
      {{"sxx", "syx", "szx", "syy", "szy", "szz"}, symmetric},
      {{"s.xx", "s.xy", "s.xz", "s.yx", "s.yy", "s.yz", "s.zx", "s.zy", "s.zz"}, rows},
      {{"s11", "s12", "s13", "s21", "s22", "s23", "s31", "s32", "s33"}, rows},
      {{"s_0", "s_1", "s_2", "s_3", "s_4", "s_5", "s_6", "s_7", "s_8"}, rows},
      {{"s.0", "s.1", "s.2", "s.3", "s.4", "s.5", "s.6", "s.7", "s.8"}, rows},
      {{"s[0]", "s[1]", "s[2]", "s[3]", "s[4]", "s[5]", "s[6]", "s[7]", "s[8]"}, rows},
  };
  for (const auto& [names, expected] : cases) {
    std::vector<std::string> in_file = names;
    in_file.push_back("density");
    std::reverse(in_file.begin(), in_file.end());
    EXPECT_THAT(tensor_names(scalars(in_file)), ElementsAre("s")) << names.front();
    for (const std::string name : {"", "s"})
      EXPECT_EQ(numbered(field_grids("a.vdb", scalars(in_file), name, Derive::none, {}), names), expected)
          << names.front();
  }
}

TEST(GridLayouts, IncompleteComponentsAreNoTensor) {
  for (const std::vector<std::string>& names : {std::vector<std::string>{"sxx", "syy", "szz", "sxy", "syz"},
                                                {"s.0", "s.1", "s.2", "s.3", "s.4", "s.5"},  // In which order?
                                                {"a.xx", "b.xy", "a.xz", "a.yy", "a.yz", "a.zz"}}) {
    EXPECT_THAT(tensor_names(scalars(names)), IsEmpty()) << names.front();
    const std::string fix = names.size() == 6 ? "/field/components" : "the grids are";
    EXPECT_THAT([&] { field_grids("a.vdb", scalars(names), "", Derive::none, {}); }, fails_with("a.vdb", fix));
  }
}

TEST(GridLayouts, VectorsOfThreeScalars) {
  const std::vector<std::vector<std::string>> cases = {{"vel.x", "vel.y", "vel.z"},    {"vel_x", "vel_y", "vel_z"},
                                                       {"velx", "vely", "velz"},       {"velX", "velY", "velZ"},
                                                       {"vel[0]", "vel[1]", "vel[2]"}, {"vel.0", "vel.1", "vel.2"}};
  for (const std::vector<std::string>& names : cases) {
    const FieldGrids field = field_grids("a.vdb", scalars(names), "", Derive::gradient, {});
    EXPECT_EQ(field.name, "vel");
    ASSERT_EQ(field.parts.size(), 3u);
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(field.parts[i].grid, names[i]);
      EXPECT_EQ(field.parts[i].entries.front().row, i);
    }
  }
  const std::vector<GridInfo> others = scalars({"Txx", "Txy", "Txz"});
  EXPECT_THAT([&] { field_grids("a.vdb", others, "", Derive::gradient, {}); }, fails_with("vector grid"));
}

TEST(GridLayouts, TheUserMapsAnyGrids) {
  const std::vector<std::string> names = {"a", "b", "c", "d", "e", "f"};
  ComponentGrids given;
  given.tensor = {"a", "b", "c", "", "d", "e", "", "", "f"};
  const FieldGrids field = field_grids("a.vdb", scalars(names), "stress", Derive::none, given);
  EXPECT_EQ(field.name, "stress");
  EXPECT_EQ(numbered(field, names), by_rows({1, 2, 3, 2, 4, 5, 3, 5, 6}));
  given.tensor = {"a", "", "c", "b", "d", "c", "", "", "f"};  // yx instead of xy; one grid for two components
  EXPECT_EQ(numbered(field_grids("a.vdb", scalars(names), "", Derive::none, given), names),
            by_rows({1, 2, 3, 2, 4, 3, 3, 3, 6}));
  ComponentGrids vector;
  vector.vector = {"c", "a", "b"};
  EXPECT_EQ(field_grids("a.vdb", scalars(names), "", Derive::gradient, vector).parts[1].grid, "a");
}

TEST(GridLayouts, AWrongMapIsAnErrorThatNamesTheKey) {
  std::vector<GridInfo> grids = scalars({"a", "b", "c", "d", "e", "f"});
  grids.push_back({"v", "vec3s", "full"});
  const auto expect = [&](Derive derive, const ComponentGrids& given, const std::string& word) {
    EXPECT_THAT([&] { field_grids("a.vdb", grids, "", derive, given); },
                fails_with("a.vdb: `/field/components`", word));
  };
  expect(Derive::none, {{"a", "b", "c", "", "d", "e", "", "", ""}, {}}, "`zz` is missing");
  expect(Derive::none, {{"a", "b", "c", "b", "d", "e", "", "", "f"}, {}}, "7 components");
  expect(Derive::none, {{"a", "b", "c", "", "d", "e", "", "", "g"}, {}}, "\"g\"");
  expect(Derive::none, {{"a", "b", "c", "", "d", "e", "", "", "v"}, {}}, "not scalar");
  expect(Derive::none, {{}, {"a", "b", "c"}}, "derive");
  expect(Derive::gradient, {{}, {"a", "b", ""}}, "needs `x`, `y` and `z`");
  expect(Derive::gradient, {{"a", "b", "c", "", "d", "e", "", "", "f"}, {}}, "`x`, `y` and `z`");
  expect(Derive::hessian, {{}, {"a", "b", "c"}}, "`name`");
}

/// A scalar grid with the value f(position) at 10³ voxels of 0.125.
openvdb::FloatGrid::Ptr scalar_of(const std::string& name, double (*f)(const Vector3d&)) {
  const auto grid = stock_grid<openvdb::FloatGrid>(name);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.125));
  for (int x = 7; x < 17; ++x)
    for (int y = 0; y < 10; ++y)
      for (int z = 0; z < 10; ++z) grid->tree().setValue({x, y, z}, static_cast<float>(f(0.125 * Vector3d(x, y, z))));
  return grid;
}

TEST(GridLayouts, ScalarGridsOfAFileAreATensorAndAGradient) {
  const Temporary path("a.vdb");
  write_stock(path, {scalar_of("vel.x", [](const Vector3d& p) { return p.x() + 2 * p.y(); }),
                     scalar_of("vel.y", [](const Vector3d& p) { return 3 * p.z(); }),
                     scalar_of("vel.z", [](const Vector3d& p) { return 4 * p.x(); })});
  const TensorGrid gradient = read_tensor_vdb(path, "", Derive::gradient);
  const Matrix3d expected = by_rows({1, 2, 0, 0, 0, 3, 4, 0, 0});
  EXPECT_LT((find(gradient, {9, 5, 5})->cast<double>() - expected).norm(), 1e-5);
  ComponentGrids given;
  given.tensor = {"vel.x", "vel.z", "vel.z", "", "vel.y", "vel.z", "", "", "vel.x"};
  for (const TensorGrid& tensor :
       {read_tensor_vdb(path, "", Derive::none, given), to_grid(open_tensor_vdb(path, "", Derive::none, given))}) {
    const Matrix3d values = by_rows({2, 4, 4, 4, 1.5, 4, 4, 4, 2});
    EXPECT_LT((find(tensor, {8, 4, 4})->cast<double>() - values).norm(), 1e-6);
  }
}

Vector3d quadratic(const Vector3d& p) {
  return {0.5 * p.x() * p.x() + p.x() * p.y(), p.y() * p.y() - p.z() * p.x(), p.z() * (p.x() - 0.25 * p.z())};
}
Matrix3d quadratic_gradient(const Vector3d& p) {
  return by_rows({p.x() + p.y(), p.x(), 0, -p.z(), 2 * p.y(), -p.x(), p.z(), 0, p.x() - 0.5 * p.z()});
}

TEST(GridLayouts, AStaggeredVelocityIsDifferentiatedOnItsFaces) {
  constexpr double h = 0.125;
  for (const bool is_staggered : {true, false}) {
    const auto grid = stock_grid<openvdb::Vec3SGrid>("vel");
    grid->setTransform(openvdb::math::Transform::createLinearTransform(h));
    if (is_staggered) grid->setGridClass(openvdb::GRID_STAGGERED);
    for (int x = 0; x < 20; ++x)
      for (int y = 0; y < 12; ++y)
        for (int z = 0; z < 12; ++z) {
          openvdb::Vec3s value;
          for (int i = 0; i < 3; ++i) {
            const Vector3d centre = h * Vector3d(x, y, z), face = centre - 0.5 * h * Vector3d::Unit(i);
            value[i] = static_cast<float>(quadratic(is_staggered ? face : centre)[i]);
          }
          grid->tree().setValue({x, y, z}, value);
        }
    const TensorGrid read = read_stock({grid}, "", Derive::gradient);
    EXPECT_EQ(read.active_voxels(), 20u * 12 * 12);
    for_each_active(read, [&](const Vector3i& index, const Matrix3f& value) {
      const bool is_inside = (index.array() > 0).all() && index.x() < 18 && index.y() < 10 && index.z() < 10;
      const double error = (value.cast<double>() - quadratic_gradient(h * index.cast<double>())).norm();
      EXPECT_LT(error, is_inside ? 1e-5 : 0.1) << is_staggered << " at " << index.transpose();
    });
    EXPECT_NEAR((*find(read, {12, 4, 4}))(0, 0), 1.5 + 0.5, 1e-5) << is_staggered;
  }
}

// Invariants of a field as float grids, read back by OpenVDB itself.

std::string text(const openvdb::MetaMap& metadata, const std::string& key) {
  return metadata.getMetadata<openvdb::StringMetadata>(key)->value();
}

TEST(ScalarFiles, HoldTheInvariantAtEachActiveVoxelWithItsUnits) {
  const std::pair<Invariant, const char*> table[] = {{Invariant::norm, "Pa/m"},
                                                     {Invariant::trace, "Pa/m"},
                                                     {Invariant::determinant, "(Pa/m)^3"},
                                                     {Invariant::mode, "1"},
                                                     {Invariant::fractional_anisotropy, "1"}};
  const TensorGrid field = sparse_grid();
  std::vector<ScalarGrid> grids;
  for (const auto& [which, units] : table) grids.push_back(invariant_grid(which, field));
  const Temporary path("a.vdb");
  write_scalar_vdb(path, grids, {});
  for (const auto& [which, units] : table) {
    const std::string name = invariant_names()[static_cast<std::size_t>(which)];
    SCOPED_TRACE(name);
    const auto grid = stock_grid_of<openvdb::FloatGrid>(path, name);
    ASSERT_TRUE(grid);
    EXPECT_EQ(grid->activeVoxelCount(), field.active_voxels());
    EXPECT_EQ(grid->background(), 0);
    EXPECT_EQ(text(*grid, "tensorray:units"), units);
    EXPECT_EQ(text(*grid, "tensorray:field"), "stress");
    const Vector3d world = to_eigen(grid->indexToWorld(openvdb::Vec3d(3, -2, 7)));
    EXPECT_LE((world - field.to_world * Vector3d(3, -2, 7)).norm(), 1e-12);
    for_each_active(field, [&, of = which](const Vector3i& index, const Matrix3f& tensor) {
      float value = 0;
      ASSERT_TRUE(grid->tree().probeValue(coord_of(index), value));
      ASSERT_EQ(value, static_cast<float>(invariant(of, tensor.cast<double>())));
    });
  }
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
  const auto read = stock_grid_of<openvdb::FloatGrid>(path, "smoke");
  EXPECT_EQ(read->getGridClass(), openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(read->activeVoxelCount(), 1u);
  EXPECT_EQ(read->getConstAccessor().getValue(openvdb::Coord(-7, 2, 19)), 0.5f);
  openvdb::io::File file(path.string());
  file.open();
  EXPECT_EQ(text(*file.getMetadata(), "tensorray:version"), "1");
}

TEST(ScalarFiles, ValuesBeyondSinglePrecisionBecomeItsEnd) {
  const TensorGrid field = unit_voxels(
      {0, 0, 0}, {0, 0, 0}, [](const Vector3i&) { return Matrix3d(Vector3d(-1e20, 1e20, 1e20).asDiagonal()); });
  EXPECT_EQ(invariant_grid(Invariant::determinant, field).blocks[0].values[0], std::numeric_limits<float>::lowest());
}

// The surface of a body in a field's file.
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

TEST(SurfaceGrids, KeepAllPointsAndTriangles) {
  const std::pair<std::uint32_t, std::uint32_t> sizes[] = {{1, 1}, {4, 4}, {256, 257}, {5000, 9999}, {70000, 66000}};
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
  const AlignedBox3d voxels = grid.active_box().cast<double>();
  for (const auto& one : stock_grids(path)) {
    ASSERT_TRUE(one->isType<openvdb::Vec3SGrid>()) << "the type that Python's module has: " << one->getName();
    const openvdb::CoordBBox box = one->evalActiveVoxelBoundingBox();
    for (const openvdb::Coord& corner : {box.min(), box.max()}) {
      const Vector3d index = grid.to_world.inverse() * to_eigen(one->indexToWorld(corner));
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
    EXPECT_THAT([&] { read_tensor_vdb(damaged); }, fails_with(damaged.string(), "surface", what));
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
