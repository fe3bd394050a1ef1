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

void hide_point(vtkDataSet& mesh, vtkIdType point) {
  vtkNew<vtkUnsignedCharArray> ghosts;
  ghosts->SetName(vtkDataSetAttributes::GhostArrayName());
  ghosts->SetNumberOfTuples(mesh.GetNumberOfPoints());
  ghosts->Fill(0);
  ghosts->SetValue(point, vtkDataSetAttributes::HIDDENPOINT);
  mesh.GetPointData()->AddArray(ghosts);
}

struct MeshCase {
  const char* name;
  std::function<vtkSmartPointer<vtkDataSet>()> make;
};

class EveryMesh : public ::testing::TestWithParam<MeshCase> {};

TEST_P(EveryMesh, DifferentiatesALinearVelocityExactlyRowByRow) {
  const auto mesh = GetParam().make();
  add_linear_velocity(*mesh, velocity_gradient());
  expect_everywhere(*with_tensors(*mesh, {"velocity"}, Take::gradient, {}), velocity_gradient(), 1e-10);
}

INSTANTIATE_TEST_SUITE_P(
    Meshes, EveryMesh,
    ::testing::Values(MeshCase{"Curvilinear",
                               [] {
                                 return curvilinear({7, 6, 5}, bent);
                               }},
                      MeshCase{"LeftHanded",
                               [] {
                                 return curvilinear({4, 5, 6}, [](const Vector3d& p) {
                                   return Vector3d(bent(p).y(), bent(p).x(), bent(p).z());
                                 });
                               }},
                      MeshCase{"Pyramids", [] { return unit_cube(VTK_PYRAMID, 3, bent); }},
                      MeshCase{"LagrangeHexahedra", [] { return unit_cube(VTK_LAGRANGE_HEXAHEDRON, 3, bent); }},
                      MeshCase{"Hexahedra", [] { return unit_cube(VTK_HEXAHEDRON, 3, bent); }},
                      MeshCase{"Wedges", [] { return unit_cube(VTK_WEDGE, 3, bent); }},
                      MeshCase{"Tetrahedra", [] { return unit_cube(VTK_TETRA, 3, bent); }},
                      MeshCase{"QuadraticHexahedra", [] { return unit_cube(VTK_QUADRATIC_HEXAHEDRON, 3, bent); }},
                      MeshCase{"QuadraticTetrahedra", [] { return unit_cube(VTK_QUADRATIC_TETRA, 3, bent); }}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(MeshTensors, RotationIsAntisymmetricAndHasNoStrain) {
  const auto mesh = curvilinear({5, 5, 5}, bent);
  Matrix3d rotation;
  rotation << 0, -3, 2, 3, 0, -1, -2, 1, 0;
  add_linear_velocity(*mesh, rotation);
  expect_everywhere(*with_tensors(*mesh, {"velocity"}, Take::gradient, {}), rotation, 1e-10);
  expect_everywhere(*with_tensors(*mesh, {"velocity"}, Take::strain, {}), Matrix3d::Zero(), 1e-10);
}

TEST(MeshTensors, StrainIsTheSymmetricPart) {
  const auto mesh = unit_cube(VTK_TETRA, 2, bent);
  add_linear_velocity(*mesh, velocity_gradient());
  const Matrix3d expected = 0.5 * (velocity_gradient() + velocity_gradient().transpose());
  expect_everywhere(*with_tensors(*mesh, {"velocity"}, Take::strain, {}), expected, 1e-10);
}

TEST(MeshTensors, SurfacesInAMeshDoNotChangeItsDerivatives) {
  const auto mesh = unit_cube(VTK_HEXAHEDRON, 2, bent);
  const std::vector<vtkIdType> face{0, 1, 2, 3};
  mesh->InsertNextCell(VTK_QUAD, 4, face.data());
  add_linear_velocity(*mesh, velocity_gradient());
  expect_everywhere(*with_tensors(*mesh, {"velocity"}, Take::gradient, {}), velocity_gradient(), 1e-10);
}

TEST(MeshTensors, ADerivativeDoesNotLookAtHiddenPoints) {
  const auto mesh = curvilinear({5, 5, 5}, bent);
  add_linear_velocity(*mesh, velocity_gradient());
  const vtkIdType hidden = 62;  // the middle point
  mesh->GetPointData()->GetArray("velocity")->SetTuple3(hidden, 1e9, -1e9, 1e9);
  hide_point(*mesh, hidden);
  const auto tensors = with_tensors(*mesh, {"velocity"}, Take::gradient, {});
  for (vtkIdType i = 0; i < 125; ++i) {
    if (i == hidden)
      EXPECT_TRUE(tensor_at(*tensors, i).array().isNaN().all());
    else
      EXPECT_LT((tensor_at(*tensors, i) - velocity_gradient()).norm(), 1e-10) << "point " << i;
  }
}

TEST(MeshTensors, SixComponentsAreTakenInTheirOrder) {
  const auto mesh = unit_cube(VTK_HEXAHEDRON, 1, identity);
  add_array<6>(*mesh, "stress",
               [](const Vector3d&) { return (Eigen::Matrix<double, 6, 1>() << 1, 2, 3, 4, 5, 6).finished(); });
  Matrix3d vtk, voigt;
  vtk << 1, 4, 6, 4, 2, 5, 6, 5, 3;
  voigt << 1, 6, 5, 6, 2, 4, 5, 4, 3;
  expect_everywhere(*with_tensors(*mesh, {"stress"}, Take::tensor, TensorOrder::vtk), vtk, 1e-15);
  expect_everywhere(*with_tensors(*mesh, {"stress"}, Take::tensor, TensorOrder::voigt), voigt, 1e-15);
  EXPECT_THAT(
      [&] { with_tensors(*mesh, {"stress"}, Take::tensor, {}); },
      ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("stress"), HasSubstr("--order"), HasSubstr("mrtrix"))));
}

TEST(MeshTensors, NamesOfComponentsSayTheOrder) {
  const auto mesh = unit_cube(VTK_HEXAHEDRON, 1, identity);
  add_array<10>(*mesh, "S", [](const Vector3d&) {
    return Eigen::Matrix<double, 10, 1>(Eigen::Matrix<double, 10, 1>::LinSpaced(1, 10));
  });
  vtkDataArray& array = *mesh->GetPointData()->GetArray("S");
  const char* const names[] = {"S11", "S22", "S33", "S23", "S31", "S12"};
  for (int i = 0; i < 6; ++i) array.SetComponentName(i, names[i]);
  Matrix3d voigt;
  voigt << 1, 6, 5, 6, 2, 4, 5, 4, 3;
  expect_everywhere(*with_tensors(*mesh, {"S"}, Take::tensor, {}), voigt, 1e-15);
  expect_everywhere(*with_tensors(*mesh, {"S"}, Take::tensor, TensorOrder::voigt), voigt, 1e-15);
  EXPECT_THAT([&] { with_tensors(*mesh, {"S"}, Take::tensor, TensorOrder::vtk); },
              ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("the file itself names the components"),
                                                         HasSubstr("S11 S22 S33 S23 S31 S12"), HasSubstr("--order"))));
}

TEST(MeshTensors, NineComponentsAreRowsAndNeedNoOrder) {
  const auto mesh = unit_cube(VTK_WEDGE, 1, identity);
  add_array<9>(*mesh, "grad", [](const Vector3d&) { return flat(velocity_gradient()); });
  expect_everywhere(*with_tensors(*mesh, {"grad"}, Take::tensor, {}), velocity_gradient(), 1e-15);
  EXPECT_THAT([&] { with_tensors(*mesh, {"grad"}, Take::tensor, TensorOrder::fsl); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("leave --order out")));
}

TEST(MeshTensors, CellArraysAreAveragedToPoints) {
  const auto mesh = curvilinear({3, 2, 2}, identity);
  add_constant_cell_array(*mesh, "T", 9, 2);
  mesh->GetCellData()->GetArray("T")->SetComponent(1, 5, 8);  // component 5 of the second cell
  const auto tensors = with_tensors(*mesh, {"T", true}, Take::tensor, {});
  EXPECT_EQ(tensor_at(*tensors, 0)(1, 2), 2);
  EXPECT_EQ(tensor_at(*tensors, 1)(1, 2), 5);
  EXPECT_EQ(tensor_at(*tensors, 2)(1, 2), 8);
  EXPECT_EQ(tensor_at(*tensors, 2)(2, 1), 2);
  EXPECT_EQ(tensors->GetNumberOfCells(), 2);
}

TEST(MeshTensors, PointsThatAreNotFiniteBecomeNotANumber) {
  const auto mesh = unit_cube(VTK_HEXAHEDRON, 1, identity);
  add_array<9>(*mesh, "T", [](const Vector3d& p) {
    Eigen::Matrix<double, 9, 1> tensor = flat(velocity_gradient());
    if (p.isZero()) tensor[4] = std::numeric_limits<double>::infinity();
    return tensor;
  });
  const auto tensors = with_tensors(*mesh, {"T"}, Take::tensor, {});
  EXPECT_TRUE(tensor_at(*tensors, 0).array().isNaN().all());
  EXPECT_EQ(tensor_at(*tensors, 1), velocity_gradient());
}

TEST(MeshTensors, TheGivenMeshStaysAsItIs) {
  const auto mesh = unit_cube(VTK_HEXAHEDRON, 1, identity);
  add_linear_velocity(*mesh, velocity_gradient());
  with_tensors(*mesh, {"velocity"}, Take::strain, {});
  EXPECT_EQ(mesh->GetPointData()->GetNumberOfArrays(), 1);
  EXPECT_STREQ(mesh->GetPointData()->GetArrayName(0), "velocity");
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
