#include "tools/import/meshes/mesh_tensors.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkCellData.h>
#include <vtkUnsignedCharArray.h>

#include "tests/import/mesh_fixtures.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const Map identity = [](const Vector3d& p) { return p; };

Matrix3d tensor_at(vtkDataSet& mesh, vtkIdType point) {
  auto* const array = vtkDoubleArray::SafeDownCast(mesh.GetPointData()->GetArray(tensor_array));
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(array->GetPointer(9 * point));
}

Matrix3d velocity_gradient() {
  Matrix3d gradient;
  gradient << 1, 2, 3, -4, 5, 6, 7, -8, 10;
  return gradient;
}

void add_linear_velocity(vtkDataSet& mesh, const Matrix3d& gradient) {
  add_array<3>(mesh, "velocity", [&](const Vector3d& p) { return Vector3d(gradient * p + Vector3d(0.3, -0.1, 0.2)); });
}

void add_constant_cell_array(vtkDataSet& mesh, const char* name, int components, double value) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(mesh.GetNumberOfCells());
  array->Fill(value);
  mesh.GetCellData()->AddArray(array);
}

void expect_everywhere(vtkDataSet& mesh, const Matrix3d& expected, double tolerance) {
  double worst = 0;
  for (vtkIdType i = 0; i < mesh.GetNumberOfPoints(); ++i)
    worst = std::max(worst, (tensor_at(mesh, i) - expected).cwiseAbs().maxCoeff());
  EXPECT_LT(worst, tolerance);
}

TEST(MeshTensors, ALinearVelocityIsDifferentiatedExactlyRowByRow) {
  std::vector<vtkSmartPointer<vtkDataSet>> meshes{curvilinear({7, 6, 5}, bent),
                                                  curvilinear({4, 5, 6}, [](const Vector3d& p) {  // Left-handed.
                                                    return Vector3d(bent(p).y(), bent(p).x(), bent(p).z());
                                                  })};
  for (const int type : {VTK_PYRAMID, VTK_LAGRANGE_HEXAHEDRON, VTK_HEXAHEDRON, VTK_WEDGE, VTK_TETRA,
                         VTK_QUADRATIC_HEXAHEDRON, VTK_QUADRATIC_TETRA})
    meshes.push_back(unit_cube(type, 3, bent));
  const Matrix3d gradient = velocity_gradient();
  for (const auto& mesh : meshes) {
    SCOPED_TRACE(mesh->GetCellType(0));
    add_linear_velocity(*mesh, gradient);
    expect_everywhere(*with_tensors(*mesh, {"velocity"}, Take::gradient, {}), gradient, 1e-10);
    expect_everywhere(*with_tensors(*mesh, {"velocity"}, Take::strain, {}), 0.5 * (gradient + gradient.transpose()),
                      1e-10);
  }
}

TEST(MeshTensors, SurfacesInAMeshDoNotChangeItsDerivatives) {
  const auto mesh = unit_cube(VTK_HEXAHEDRON, 2, bent);
  const std::vector<vtkIdType> face{0, 1, 2, 3};
  mesh->InsertNextCell(VTK_QUAD, 4, face.data());
  add_linear_velocity(*mesh, velocity_gradient());
  expect_everywhere(*with_tensors(*mesh, {"velocity"}, Take::gradient, {}), velocity_gradient(), 1e-10);
}

TEST(ChooseArray, TakesTheNamedOrTheOnlyOneThatSuits) {
  const auto mesh = unit_cube(VTK_HEXAHEDRON, 1, identity);
  add_linear_velocity(*mesh, velocity_gradient());
  add_array<9>(*mesh, "grad", [](const Vector3d& p) { return flat(linear_tensor(p)); });
  add_constant_cell_array(*mesh, "grad", 9, 1);
  add_constant_cell_array(*mesh, "velocity", 6, 1);
  EXPECT_EQ(choose_array(*mesh, "", Take::gradient).name, "velocity");
  const ArrayChoice points = choose_array(*mesh, "grad", Take::tensor);
  EXPECT_EQ(points.name, "grad");
  EXPECT_FALSE(points.of_cells);
  EXPECT_TRUE(choose_array(*mesh, "velocity", Take::tensor).of_cells);  // the point array does not suit
}

TEST(ChooseArray, ErrorsListTheArrays) {
  const auto mesh = unit_cube(VTK_HEXAHEDRON, 1, identity);
  const auto refuses = [&](const char* name, Take take, const auto& matcher) {
    EXPECT_THAT([&] { choose_array(*mesh, name, take); }, ThrowsMessage<std::invalid_argument>(matcher));
  };
  refuses("", Take::tensor, HasSubstr("there are no arrays"));
  add_linear_velocity(*mesh, velocity_gradient());
  add_constant_cell_array(*mesh, "pressure", 1, 1);
  const auto list = HasSubstr("there are: velocity (3 components, points), pressure (1 component, cells)");
  refuses("", Take::tensor, AllOf(list, HasSubstr("no array suits")));
  refuses("vellocity", Take::gradient, AllOf(list, HasSubstr("no array \"vellocity\" (--gradient-of)")));
  refuses("pressure", Take::strain, AllOf(list, HasSubstr("\"pressure\" has 1 component,"), HasSubstr("--strain-of")));
  add_array<3>(*mesh, "momentum", [](const Vector3d& p) { return p; });
  refuses("", Take::gradient, AllOf(HasSubstr("several"), HasSubstr("momentum (3 components, points)")));
}

}  // namespace
}  // namespace tensorray
