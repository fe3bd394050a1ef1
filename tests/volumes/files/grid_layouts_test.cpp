#include "volumes/files/grid_layouts.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/volumes/file_support.h"
#include "volumes/files/tensor_files.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

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
  const Matrix3d symmetric = (Matrix3d() << 1, 2, 3, 2, 4, 5, 3, 5, 6).finished();
  const Matrix3d rows = (Matrix3d() << 1, 2, 3, 4, 5, 6, 7, 8, 9).finished();
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
    EXPECT_THAT([&] { field_grids("a.vdb", scalars(names), "", Derive::none, {}); },
                ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("a.vdb"), HasSubstr(fix))));
  }
}

TEST(GridLayouts, VectorsOfThreeScalars) {
  const std::vector<std::vector<std::string>> cases = {
      {"vel.x", "vel.y", "vel.z"}, {"vel_x", "vel_y", "vel_z"},    {"velx", "vely", "velz"},
      {"velX", "velY", "velZ"},    {"vel[0]", "vel[1]", "vel[2]"}, {"vel.0", "vel.1", "vel.2"},
  };
  for (const std::vector<std::string>& names : cases) {
    const FieldGrids field = field_grids("a.vdb", scalars(names), "", Derive::gradient, {});
    EXPECT_EQ(field.name, "vel");
    ASSERT_EQ(field.parts.size(), 3u);
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(field.parts[i].grid, names[i]);
      EXPECT_EQ(field.parts[i].entries.front().row, i);
    }
  }
  EXPECT_THAT(
      [&] {
        field_grids("a.vdb", scalars({"Txx", "Txy", "Txz"}), "", Derive::gradient, {});
      },
      ThrowsMessage<std::runtime_error>(HasSubstr("vector grid")));
}

TEST(GridLayouts, TheUserMapsAnyGrids) {
  const std::vector<std::string> names = {"a", "b", "c", "d", "e", "f"};
  ComponentGrids given;
  given.tensor = {"a", "b", "c", "", "d", "e", "", "", "f"};
  const FieldGrids field = field_grids("a.vdb", scalars(names), "stress", Derive::none, given);
  EXPECT_EQ(field.name, "stress");
  EXPECT_EQ(numbered(field, names), (Matrix3d() << 1, 2, 3, 2, 4, 5, 3, 5, 6).finished());
  given.tensor = {"a", "", "c", "b", "d", "c", "", "", "f"};  // yx instead of xy; one grid for two components
  EXPECT_EQ(numbered(field_grids("a.vdb", scalars(names), "", Derive::none, given), names),
            (Matrix3d() << 1, 2, 3, 2, 4, 3, 3, 3, 6).finished());
  ComponentGrids vector;
  vector.vector = {"c", "a", "b"};
  EXPECT_EQ(field_grids("a.vdb", scalars(names), "", Derive::gradient, vector).parts[1].grid, "a");
}

TEST(GridLayouts, AWrongMapIsAnErrorThatNamesTheKey) {
  std::vector<GridInfo> grids = scalars({"a", "b", "c", "d", "e", "f"});
  grids.push_back({"v", "vec3s", "full"});
  const auto expect = [&](Derive derive, const ComponentGrids& given, const std::string& word) {
    EXPECT_THAT([&] { field_grids("a.vdb", grids, "", derive, given); },
                ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("a.vdb: `/field/components`"), HasSubstr(word))));
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
  const auto grid = stock_grid<openvdb::FloatGrid>(name, 0);
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
  const Matrix3d expected = (Matrix3d() << 1, 2, 0, 0, 0, 3, 4, 0, 0).finished();
  EXPECT_LT((find(gradient, {9, 5, 5})->cast<double>() - expected).norm(), 1e-5);
  ComponentGrids given;
  given.tensor = {"vel.x", "vel.z", "vel.z", "", "vel.y", "vel.z", "", "", "vel.x"};
  for (const TensorGrid& tensor :
       {read_tensor_vdb(path, "", Derive::none, given), to_grid(open_tensor_vdb(path, "", Derive::none, given))}) {
    const Matrix3d values = (Matrix3d() << 2, 4, 4, 4, 1.5, 4, 4, 4, 2).finished();
    EXPECT_LT((find(tensor, {8, 4, 4})->cast<double>() - values).norm(), 1e-6);
  }
}

/// A quadratic vector field, and its gradient.
Vector3d quadratic(const Vector3d& p) {
  return {0.5 * p.x() * p.x() + p.x() * p.y(), p.y() * p.y() - p.z() * p.x(), p.z() * (p.x() - 0.25 * p.z())};
}
Matrix3d quadratic_gradient(const Vector3d& p) {
  Matrix3d t;
  t << p.x() + p.y(), p.x(), 0, -p.z(), 2 * p.y(), -p.x(), p.z(), 0, p.x() - 0.5 * p.z();
  return t;
}

TEST(GridLayouts, AStaggeredVelocityIsDifferentiatedOnItsFaces) {
  constexpr double h = 0.125;
  for (const bool is_staggered : {true, false}) {
    const auto grid = stock_grid<openvdb::Vec3SGrid>("vel", openvdb::Vec3s(0));
    grid->setTransform(openvdb::math::Transform::createLinearTransform(h));
    if (is_staggered) grid->setGridClass(openvdb::GRID_STAGGERED);
    for (int x = 0; x < 20; ++x)
      for (int y = 0; y < 12; ++y)
        for (int z = 0; z < 12; ++z) {
          const Vector3d centre = h * Vector3d(x, y, z);
          Vector3d value;
          for (int i = 0; i < 3; ++i)
            value[i] = quadratic(is_staggered ? Vector3d(centre - 0.5 * h * Vector3d::Unit(i)) : centre)[i];
          grid->tree().setValue({x, y, z}, openvdb::Vec3s(openvdb::Vec3d(value.x(), value.y(), value.z())));
        }
    const Temporary path("a.vdb");
    write_stock(path, {grid});
    const TensorGrid read = read_tensor_vdb(path, "", Derive::gradient);
    EXPECT_EQ(read.active_voxels(), 20u * 12 * 12);
    double inside = 0, anywhere = 0;
    for (const TensorBlock& block : read.blocks)
      for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
        if (!block.active[offset]) continue;
        const Eigen::Vector3i index = block.origin + TensorBlock::position(offset);
        const double error =
            (block.values[offset].cast<double>() - quadratic_gradient(h * index.cast<double>())).norm();
        anywhere = std::max(anywhere, error);
        const bool is_inside = (index.array() > 0).all() && index.x() < 18 && index.y() < 10 && index.z() < 10;
        if (is_inside) inside = std::max(inside, error);
      }
    EXPECT_LT(inside, 1e-5) << is_staggered;
    EXPECT_LT(anywhere, 0.1) << is_staggered;
    EXPECT_NEAR((*find(read, {12, 4, 4}))(0, 0), 1.5 + 0.5, 1e-5) << is_staggered;
  }
}

}  // namespace
}  // namespace tensorray
