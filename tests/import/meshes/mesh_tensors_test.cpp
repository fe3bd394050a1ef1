#include "tools/import/meshes/mesh_tensors.h"

#include <map>

#include "tests/import/velocity_meshes.h"
#include "tests/import/vtk_files.h"
#include "tools/import/meshes/flat_mesh.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;

Matrix3d tensor_at(vtkDataSet& mesh, vtkIdType point) {
  auto* const array = vtkDoubleArray::SafeDownCast(mesh.GetPointData()->GetArray(tensor_array));
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(array->GetPointer(9 * point));
}

/// Adds a point array with the number that `value` returns at each point.
void add_numbers(vtkDataSet& mesh, const std::string& name, const std::function<double(const Vector3d&)>& value) {
  add_array<1>(mesh, name, [&](const Vector3d& p) { return Eigen::Matrix<double, 1, 1>(value(p)); });
}

/// A cell array of ones.
template <int components>
void add_ones(vtkDataSet& mesh, const char* name) {
  add_cell_array<components>(mesh, name, [](vtkIdType) { return Eigen::Matrix<double, components, 1>::Ones(); });
}

TEST(MeshTensors, ALinearVelocityIsDifferentiatedExactlyRowByRow) {
  std::vector<vtkSmartPointer<vtkDataSet>> meshes{curvilinear({7, 6, 5}, bent),
                                                  curvilinear({4, 5, 6}, [](const Vector3d& p) {  // Left-handed.
                                                    return Vector3d(bent(p).y(), bent(p).x(), bent(p).z());
                                                  })};
  for (const int type : {VTK_PYRAMID, VTK_LAGRANGE_HEXAHEDRON, VTK_HEXAHEDRON, VTK_WEDGE, VTK_TETRA,
                         VTK_QUADRATIC_HEXAHEDRON, VTK_QUADRATIC_TETRA})
    meshes.push_back(unit_cube(type, 3, bent));
  const auto with_surface = unit_cube(VTK_HEXAHEDRON, 2, bent);  // A surface in a mesh does not count.
  const std::vector<vtkIdType> face{0, 1, 2, 3};
  with_surface->InsertNextCell(VTK_QUAD, 4, face.data());
  meshes.push_back(with_surface);
  const Matrix3d strain = 0.5 * (shear() + shear().transpose());
  for (const auto& mesh : meshes) {
    SCOPED_TRACE(mesh->GetCellType(0));
    add_array<3>(*mesh, "velocity", linear);
    for (const auto& [take, expected] : {std::pair(Take::gradient, shear()), {Take::strain, strain}}) {
      const auto tensors = with_tensors(*mesh, {"velocity"}, take, {});
      for (vtkIdType i = 0; i < mesh->GetNumberOfPoints(); ++i)
        EXPECT_LT((tensor_at(*tensors, i) - expected).cwiseAbs().maxCoeff(), 1e-10) << i;
    }
  }
}

TEST(ChooseArray, TakesTheNamedOrTheOnlyOneThatSuits) {
  const auto mesh = unit_cube(VTK_HEXAHEDRON, 1, unchanged);
  add_array<3>(*mesh, "velocity", linear);
  add_array<9>(*mesh, "grad", [](const Vector3d& p) { return flat(linear_tensor(p)); });
  add_ones<9>(*mesh, "grad");
  add_ones<6>(*mesh, "velocity");
  EXPECT_EQ(choose_array(*mesh, "", Take::gradient).name, "velocity");
  const ArrayChoice points = choose_array(*mesh, "grad", Take::tensor);
  EXPECT_EQ(points.name, "grad");
  EXPECT_FALSE(points.of_cells);
  EXPECT_TRUE(choose_array(*mesh, "velocity", Take::tensor).of_cells);  // the point array does not suit
}

TEST(ChooseArray, ErrorsListTheArrays) {
  const auto mesh = unit_cube(VTK_HEXAHEDRON, 1, unchanged);
  const auto refuses = [&](const char* name, Take take, const auto& matcher) {
    EXPECT_THAT([&] { choose_array(*mesh, name, take); }, ThrowsMessage<std::invalid_argument>(matcher));
  };
  refuses("", Take::tensor, HasSubstr("there are no arrays"));
  add_array<3>(*mesh, "velocity", linear);
  add_ones<1>(*mesh, "pressure");
  const auto list = HasSubstr("there are: velocity (3 components, points), pressure (1 component, cells)");
  refuses("", Take::tensor, AllOf(list, HasSubstr("no array suits")));
  refuses("vellocity", Take::gradient, AllOf(list, HasSubstr("no array \"vellocity\" (--gradient-of)")));
  refuses("pressure", Take::strain, AllOf(list, HasSubstr("\"pressure\" has 1 component,"), HasSubstr("--strain-of")));
  add_array<3>(*mesh, "momentum", [](const Vector3d& p) { return p; });
  refuses("", Take::gradient, AllOf(HasSubstr("several"), HasSubstr("momentum (3 components, points)")));
}

Matrix3d symmetric(const Vector3d& p) { return linear_tensor(p) + linear_tensor(p).transpose(); }

/// A cube with a point array for each component of a tensor: sxx, sxy, ..., szz.
Grid cube_with_components() {
  const Grid mesh = unit_cube(VTK_HEXAHEDRON, 2, unchanged);
  for (int i = 0; i < 9; ++i)
    add_numbers(*mesh, std::string("s") + "xyz"[i / 3] + "xyz"[i % 3],
                [&](const Vector3d& p) { return symmetric(p)(i / 3, i % 3); });
  return mesh;
}

void expect_tensors(vtkDataSet& mesh, const std::string& list, TensorOrder order) {
  const ArrayChoice choice = join_arrays(mesh, list);
  EXPECT_FALSE(choice.of_cells);
  const auto joined = with_tensors(mesh, choice, Take::tensor, order);
  ASSERT_TRUE(joined->GetPointData()->HasArray(tensor_array));
  for (vtkIdType i = 0; i < mesh.GetNumberOfPoints(); ++i)
    EXPECT_EQ(tensor_at(*joined, i), symmetric(Vector3d(mesh.GetPoint(i)))) << list;
}

TEST(ComponentArrays, NamesThatTellNoOrderNeedOne) {
  const Grid mesh = cube_with_components();
  const char* const given[] = {"sxx", "syy", "szz", "syz", "sxz", "sxy"};
  for (int i = 0; i < 6; ++i) mesh->GetPointData()->GetArray(given[i])->SetName(std::string(1, "abcdef"[i]).c_str());
  const Grid same = Grid::New();
  same->DeepCopy(mesh);
  EXPECT_THAT([&] { with_tensors(*same, join_arrays(*same, "a,b,c,d,e,f"), Take::tensor, {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("--order")));
  expect_tensors(*mesh, "a,b,c,d,e,f", TensorOrder::voigt);
}

TEST(ComponentArrays, NamesMayHaveCommas) {
  const Grid one = cube_with_components();
  EXPECT_TRUE(is_array_list(*one, "sxx,syy"));
  EXPECT_FALSE(is_array_list(*one, "sxx"));
  one->GetPointData()->GetArray("sxx")->SetName("sxx,syy");
  EXPECT_FALSE(is_array_list(*one, "sxx,syy"));
  for (const std::string form : {"S,@", "S, @", "S,stress,@", "@,"}) {
    const Grid mesh = cube_with_components();
    std::string list;
    for (const std::string each : {"xx", "yy", "zz", "xy", "yz", "xz"}) {
      std::string name = form;
      mesh->GetPointData()->GetArray(("s" + each).c_str())->SetName(name.replace(name.find('@'), 1, each).c_str());
      list += (list.empty() ? "" : form == "S,@" ? "," : " , ") + name;
    }
    EXPECT_TRUE(is_array_list(*mesh, list));
    expect_tensors(*mesh, list, TensorOrder::vtk);
  }
}

TEST(ComponentArrays, ErrorsNameTheArrayAndListTheOthers) {
  const Grid mesh = cube_with_components();
  add_array<3>(*mesh, "v", [](const Vector3d& p) { return p; });
  add_ones<1>(*mesh, "c");
  for (const auto& [list, part] :
       {std::pair("sxx,syy,szz,sxy,syz", "lists 5 arrays, and a tensor has 6 or 9"),
        {"sxx,syy,szz,sxy,syz,sxz,", "no array \"\" in the list"},
        {"sxx,syy,szz,sxy,syz,swz", "no array \"swz\" in the list"},
        {"sxx,syy,szz,sxy,syz,v", "array \"v\" has 3 components"},
        {"sxx,syy,szz,sxy,syz,c", "some arrays of the list are at points, others at cells"}}) {
    EXPECT_THAT(([&, list = list] { join_arrays(*mesh, list); }),
                ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr(part), HasSubstr("there are: sxx (1 component"))))
        << list;
  }
  EXPECT_TRUE(mesh->GetPointData()->HasArray("sxx"));  // A refused list changes nothing.
}

// Meshes in a plane become slabs of one voxel.
/// The cells of each type that fill a square: their points, numbered row by row in a grid of 3 x 3. Of two cells, one
/// is clockwise.
const std::map<int, std::vector<std::vector<int>>> cells_of_square{
    {VTK_QUAD, {{0, 2, 8, 6}}},
    {VTK_TRIANGLE, {{0, 2, 8}, {0, 6, 8}}},
    {VTK_POLYGON, {{0, 1, 2, 8, 6}}},
    {VTK_QUADRATIC_QUAD, {{0, 2, 8, 6, 1, 5, 7, 3}}},
    {VTK_QUADRATIC_TRIANGLE, {{0, 2, 6, 1, 4, 3}, {2, 6, 8, 4, 7, 5}}}};

/// The square from 0 to 4 as 8 x 8 squares of cells of a type, in a plane across `axis` at 1.5.
Grid square(int cell_type, int axis = 2) {
  auto grid = Grid::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  grid->SetPoints(points);
  for (int i = 0; i < 8 * 8; ++i)
    for (const std::vector<int>& places : cells_of_square.at(cell_type)) {
      vtkNew<vtkIdList> ids;
      for (const int place : places) {
        Vector3d p = Vector3d::Constant(1.5);
        p[(axis + 1) % 3] = 0.5 * (i / 8) + 0.25 * (place % 3);
        p[(axis + 2) % 3] = 0.5 * (i % 8) + 0.25 * (place / 3);
        ids->InsertNextId(points->InsertNextPoint(p.data()));
      }
      grid->InsertNextCell(cell_type, ids);
    }
  return grid;
}

/// A plane tensor that is linear in the position: xx, yy, zz, xy.
Eigen::Vector4d plane(const Vector3d& p) { return {1 + p.x(), 2 - p.y() + p.z(), 0.25, 0.5 * p.x() - 0.25 * p.y()}; }

Matrix3d plane_tensor(const Vector3d& p) {
  const Eigen::Vector4d c = plane(p);
  return (Matrix3d() << c[0], c[3], 0, c[3], c[1], 0, 0, 0, c[2]).finished();
}

void expect_everywhere(const TensorGrid& grid, const std::function<Matrix3d(const Vector3d&)>& tensor) {
  for_each_voxel(grid, [&](const Vector3d& p, const Matrix3d& value) {
    EXPECT_LT((value - tensor(p)).norm(), 1e-5) << p.transpose();
  });
}

class FlatMesh : public testing::Test {
 protected:
  void write(vtkDataSet& mesh) const {
    std::filesystem::remove(folder_ / "a.xml");
    write_xml(mesh, folder_ / "a.xml");
  }
  Imported read() const { return imported(folder_ / "a.xml", settings_); }

  /// Expects an error of the user's with the file and these words.
  void refuses(const std::string& words) const {
    EXPECT_THAT([&] { read(); }, ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("a.xml"), HasSubstr(words))));
  }

  /// Chooses the array S, of plane tensors.
  void choose_plane(double thickness) {
    settings_ = array_settings("S");
    settings_.order = TensorOrder::plane;
    settings_.thickness = thickness;
  }

  TemporaryFolder folder_;
  ImportSettings settings_;
};

TEST_F(FlatMesh, CellsOfEveryTypeBecomeASlabOfOneVoxel) {
  choose_plane(0.75);
  settings_.sampling.resolution = 0.25;
  for (const int axis : {0, 1, 2})
    for (const auto& [type, cells] : cells_of_square) {
      SCOPED_TRACE(std::to_string(type) + " across " + std::to_string(axis));
      const Grid mesh = square(type, axis);
      add_array<4>(*mesh, "S", plane);
      write(*mesh);
      const auto [grid, report] = read();
      EXPECT_EQ(report.thickness, 0.75);
      EXPECT_EQ(grid.active_voxels(), 17u * 17);
      const Eigen::AlignedBox3i box = grid.active_box();
      EXPECT_EQ(box.min()[axis], box.max()[axis]);
      EXPECT_NEAR(grid.to_world.linear()(axis, axis), 0.75, 1e-12);
      EXPECT_NEAR((grid.to_world * box.min().cast<double>())[axis], 1.5, 1e-12);
      expect_everywhere(grid, plane_tensor);
    }
}

TEST_F(FlatMesh, FourComponentsNeedTheirOrderUnlessTheirNamesTell) {
  const Grid mesh = square(VTK_QUAD);
  add_array<4>(*mesh, "S", plane);
  write(*mesh);
  refuses("no array suits");  // Four may be colours.
  settings_.array = "S";
  refuses("plane (xx yy zz xy) or 2x2");
  settings_.order = TensorOrder::vtk;
  EXPECT_THROW(read(), std::invalid_argument);
  settings_.order = TensorOrder::two_by_two;
  expect_everywhere(read().grid, [](const Vector3d& p) {
    const Eigen::Vector4d c = plane(p);
    return (Matrix3d() << c[0], c[1], 0, c[2], c[3], 0, 0, 0, 0).finished();
  });
  const char* const names[] = {"XX", "YY", "ZZ", "XY"};
  for (int i = 0; i < 4; ++i) mesh->GetPointData()->GetArray("S")->SetComponentName(i, names[i]);
  write(*mesh);
  settings_.order.reset();
  expect_everywhere(read().grid, plane_tensor);
}

TEST_F(FlatMesh, ScalarArraysOfAPlaneAreJoined) {
  const Grid mesh = square(VTK_QUAD);
  const char* const names[] = {"sxx", "syy", "szz", "sxy"};
  for (int i = 0; i < 4; ++i) add_numbers(*mesh, names[i], [i](const Vector3d& p) { return plane(p)[i]; });
  write(*mesh);
  settings_.array = "sxx,syy,sxy";
  expect_everywhere(read().grid, [](const Vector3d& p) {
    Matrix3d expected = plane_tensor(p);
    expected(2, 2) = 0;
    return expected;
  });
  settings_.array = "sxy,szz,sxx,syy";
  expect_everywhere(read().grid, plane_tensor);
  settings_.array = "sxx,syy,szz";
  refuses("xx, yy, xy");
}

TEST_F(FlatMesh, FlatImagesAndRectilinearGrids) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(5, 4, 1);
  add_array<4>(*image, "S", plane);
  choose_plane(3);
  write(*image);
  const TensorGrid voxels = read().grid;
  EXPECT_EQ(voxels.active_voxels(), 20u);
  EXPECT_EQ(voxels.to_world.linear()(2, 2), 3);
  expect_everywhere(voxels, plane_tensor);

  const auto rectilinear = rectilinear_grid({0, 1, 4}, {0, 1, 4}, {2});
  add_array<4>(*rectilinear, "S", plane);
  settings_.sampling.resolution = 0.5;
  write(*rectilinear);
  EXPECT_EQ(read().voxels(), 81u);
}

TEST_F(FlatMesh, SurfacesInSpaceAndWrongFlagsAreErrors) {
  const auto tilted = curvilinear({9, 9, 1}, [](const Vector3d& p) { return Vector3d(p.x(), p.y(), 0.1 * p.x()); });
  add_array<9>(*tilted, "T", [](const Vector3d& p) { return flat(linear_tensor(p)); });
  write(*tilted);
  refuses("surface in space");
  settings_.thickness = 1;
  for (const vtkSmartPointer<vtkDataSet>& solid : {vtkSmartPointer<vtkDataSet>(bar(0, 3)), {image()}}) {
    SCOPED_TRACE(solid->GetClassName());
    write(*solid);
    refuses("--thickness");
  }
}

/// Images keep their voxels, and are fields of a plane as meshes are.
TEST_F(FlatMesh, VectorsOfImagesMayHaveTwoComponents) {
  const auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(5, 4, 1);
  const auto v = [](const Vector3d& p) { return Vector2d(2 * p.x() + 3 * p.y(), 5 * p.x() - p.y()); };
  add_array<2>(*image, "v", v);
  add_numbers(*image, "u", [&](const Vector3d& p) { return v(p).x(); });
  add_numbers(*image, "w", [&](const Vector3d& p) { return v(p).y(); });
  write(*image);
  const Matrix3d expected = (Matrix3d() << 2, 3, 0, 5, -1, 0, 0, 0, 0).finished();
  for (const char* array : {"v", "u,w"})
    for (const bool sampled : {false, true}) {
      settings_ = array_settings(array, Take::gradient, sampled ? 0.5 : 0);
      const TensorGrid grid = read().grid;
      EXPECT_EQ(grid.active_voxels(), sampled ? 9u * 7 : 5u * 4);
      expect_everywhere(grid, [&](const Vector3d&) { return expected; });
    }
}

TEST_F(FlatMesh, TheThicknessIsNoEdgeThatIsDivided) {
  const Grid mesh = square(VTK_QUAD);
  add_array<4>(*mesh, "S", plane);
  write(*mesh);
  choose_plane(100);
  for (const auto& resolution : {decltype(settings_.sampling.resolution)(17), {Vector3i(17, 17, 1)}}) {
    settings_.sampling.resolution = resolution;
    EXPECT_EQ(read().voxels(), 17u * 17);
  }
  settings_.sampling.resolution = {};
  settings_.sampling.bounds = AlignedBox3d(Vector3d(1, 1, 0), Vector3d(1.25, 1.25, 0));  // Half of an edge.
  EXPECT_EQ(read().voxels(), 4u);
}

}  // namespace
}  // namespace tensorray
