#include <gmock/gmock.h>
#include <vtkCellData.h>

#include "tests/import/mesh_fixtures.h"
#include "tools/import/meshes/mesh_tensors.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Matrix3d symmetric(const Vector3d& p) { return linear_tensor(p) + linear_tensor(p).transpose(); }

/// A cube with a point array for each component of a tensor: sxx, sxy, ..., szz.
Grid cube_with_components(Matrix3d (*tensor)(const Vector3d&)) {
  const Grid mesh = unit_cube(VTK_HEXAHEDRON, 2, [](const Vector3d& p) { return p; });
  for (int i = 0; i < 9; ++i)
    add_array<1>(*mesh, std::string("s") + "xyz"[i / 3] + "xyz"[i % 3],
                 [&](const Vector3d& p) { return Eigen::Matrix<double, 1, 1>(tensor(p)(i / 3, i % 3)); });
  return mesh;
}

void expect_tensors(vtkDataSet& mesh, const std::string& list, std::optional<TensorOrder> order,
                    Matrix3d (*tensor)(const Vector3d&)) {
  const ArrayChoice choice = join_arrays(mesh, list);
  EXPECT_FALSE(choice.of_cells);
  const auto joined = with_tensors(mesh, choice, Take::tensor, order);
  auto* const tensors = vtkDoubleArray::SafeDownCast(joined->GetPointData()->GetArray(tensor_array));
  ASSERT_TRUE(tensors);
  for (vtkIdType i = 0; i < mesh.GetNumberOfPoints(); ++i) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> value(tensors->GetPointer(9 * i));
    EXPECT_EQ(Matrix3d(value), tensor(Vector3d(mesh.GetPoint(i)))) << list;
  }
}

TEST(ComponentArrays, NamesThatTellNoOrderNeedOne) {
  const Grid mesh = cube_with_components(symmetric);
  const char* const given[] = {"sxx", "syy", "szz", "syz", "sxz", "sxy"};
  for (int i = 0; i < 6; ++i) mesh->GetPointData()->GetArray(given[i])->SetName(std::string(1, "abcdef"[i]).c_str());
  const Grid same = Grid::New();
  same->DeepCopy(mesh);
  EXPECT_THAT([&] { with_tensors(*same, join_arrays(*same, "a,b,c,d,e,f"), Take::tensor, {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("--order")));
  expect_tensors(*mesh, "a,b,c,d,e,f", TensorOrder::voigt, symmetric);
}

TEST(ComponentArrays, AnArrayWithCommasInItsNameIsNoList) {
  const Grid mesh = cube_with_components(symmetric);
  EXPECT_TRUE(is_array_list(*mesh, "sxx,syy"));
  EXPECT_FALSE(is_array_list(*mesh, "sxx"));
  mesh->GetPointData()->GetArray("sxx")->SetName("sxx,syy");
  EXPECT_FALSE(is_array_list(*mesh, "sxx,syy"));
}

TEST(ComponentArrays, NamesInAListMayHaveCommas) {
  for (const std::string form : {"S,@", "S, @", "S,stress,@", "@,"}) {
    const Grid mesh = cube_with_components(symmetric);
    std::string list;
    for (const std::string each : {"xx", "yy", "zz", "xy", "yz", "xz"}) {
      std::string name = form;
      mesh->GetPointData()->GetArray(("s" + each).c_str())->SetName(name.replace(name.find('@'), 1, each).c_str());
      list += (list.empty() ? "" : form == "S,@" ? "," : " , ") + name;
    }
    EXPECT_TRUE(is_array_list(*mesh, list));
    expect_tensors(*mesh, list, TensorOrder::vtk, symmetric);
  }
}

TEST(ComponentArrays, ErrorsNameTheArrayAndListTheOthers) {
  const Grid mesh = cube_with_components(symmetric);
  add_array<3>(*mesh, "v", [](const Vector3d& p) { return p; });
  vtkNew<vtkDoubleArray> of_cells;
  of_cells->SetName("c");
  of_cells->SetNumberOfTuples(mesh->GetNumberOfCells());
  of_cells->Fill(0);
  mesh->GetCellData()->AddArray(of_cells);
  for (const auto& [list, part] :
       {std::pair("sxx,syy,szz,sxy,syz", "lists 5 arrays, and a tensor has 6 or 9"),
        {"sxx,syy,szz,sxy,syz,sxz,", "no array \"\" in the list"},
        {"sxx,syy,szz,sxy,syz,swz", "no array \"swz\" in the list"},
        {"sxx,syy,szz,sxy,syz,v", "array \"v\" has 3 components"},
        {"sxx,syy,szz,sxy,syz,c", "some arrays of the list are at points, others at cells"}}) {
    const char* const given = list;
    EXPECT_THAT([&] { join_arrays(*mesh, given); },
                ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr(part), HasSubstr("there are: sxx (1 component"))))
        << list;
  }
  EXPECT_TRUE(mesh->GetPointData()->HasArray("sxx"));  // A refused list changes nothing.
}

}  // namespace
}  // namespace tensorray
