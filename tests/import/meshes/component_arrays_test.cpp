#include "tools/import/meshes/component_arrays.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <vtkCellData.h>

#include "base/process/progress.h"
#include "tests/import/mesh_files.h"
#include "tests/import/mesh_fixtures.h"
#include "tests/import/vtk_files.h"
#include "tools/import/import_file.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Matrix3d symmetric(const Vector3d& p) { return linear_tensor(p) + linear_tensor(p).transpose(); }

/// Adds a point array for each component of `tensor`: sxx, sxy, ..., szz.
void add_components(vtkDataSet& mesh, Matrix3d (*tensor)(const Vector3d&)) {
  for (int i = 0; i < 9; ++i)
    add_array<1>(mesh, std::string("s") + "xyz"[i / 3] + "xyz"[i % 3],
                 [&](const Vector3d& p) { return Eigen::Matrix<double, 1, 1>(tensor(p)(i / 3, i % 3)); });
}

vtkSmartPointer<vtkImageData> image_with_components(Matrix3d (*tensor)(const Vector3d&)) {
  auto set = vtkSmartPointer<vtkImageData>::New();
  set->SetDimensions(5, 4, 3);
  set->SetOrigin(1, 2, 3);
  set->SetSpacing(0.5, 1, 2);
  add_components(*set, tensor);
  return set;
}

/// The largest difference to `tensor` at the active voxels, of which there must be `voxels`.
double difference(const TensorGrid& grid, std::size_t voxels, Matrix3d (*tensor)(const Vector3d&)) {
  EXPECT_EQ(grid.active_voxels(), voxels);
  double largest = 0;
  for_each_voxel(grid, [&](const Vector3d& position, const Matrix3d& value) {
    largest = std::max(largest, (value - tensor(position)).cwiseAbs().maxCoeff());
  });
  return largest;
}

TensorGrid import_list(const std::filesystem::path& file, const std::string& list,
                       std::optional<TensorOrder> order = {}) {
  ImportSettings settings;
  settings.files = {file};
  settings.array = list;
  settings.order = order;
  ImportReport report;
  return import_tensors(settings, Progress(), report);
}

TEST(ComponentArrays, SixInAnyOrderThatTheirNamesTellAndNine) {
  const TemporaryFolder folder;
  write_xml(*image_with_components(symmetric), folder / "six.vti");
  for (const char* list : {"sxx,syy,szz,sxy,syz,sxz", "sxx, sxy, sxz, syy, syz, szz", "sxx,syy,szz,szy,szx,syx",
                           "sxx,sxy,syy,sxz,syz,szz"}) {
    const TensorGrid grid = import_list(folder / "six.vti", list);
    EXPECT_LT(difference(grid, 60, symmetric), 1e-5) << list;
    EXPECT_EQ(grid.name, "tensor");
  }
  write_xml(*image_with_components(linear_tensor), folder / "nine.vti");
  EXPECT_LT(difference(import_list(folder / "nine.vti", "sxx,sxy,sxz,syx,syy,syz,szx,szy,szz"), 60, linear_tensor),
            1e-5);
  write_xml(*image_with_components(symmetric), folder / "nine.vti");
  EXPECT_LT(difference(import_list(folder / "nine.vti", "sxx,sxy,sxz,sxy,syy,syz,sxz,syz,szz"), 60, symmetric), 1e-5);
}

TEST(ComponentArrays, NamesThatTellNoOrderNeedOne) {
  const TemporaryFolder folder;
  const auto image = image_with_components(symmetric);
  const char* const given[] = {"sxx", "syy", "szz", "syz", "sxz", "sxy"};
  for (int i = 0; i < 6; ++i) image->GetPointData()->GetArray(given[i])->SetName(std::string(1, "abcdef"[i]).c_str());
  write_xml(*image, folder / "file.vti");
  EXPECT_THAT([&] { import_list(folder / "file.vti", "a,b,c,d,e,f"); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("--order")));
  EXPECT_LT(difference(import_list(folder / "file.vti", "a,b,c,d,e,f", TensorOrder::voigt), 60, symmetric), 1e-5);
}

TEST(ComponentArrays, OfAMeshWithTheNameOfAnArrayThatIsThere) {
  const auto mesh = unit_cube(VTK_HEXAHEDRON, 2, [](const Vector3d& p) { return p; });
  add_components(*mesh, symmetric);
  add_array<1>(*mesh, "tensor", [](const Vector3d&) { return Eigen::Matrix<double, 1, 1>(7.0); });
  const ArrayChoice choice = join_arrays(*mesh, "sxx,syy,szz,sxy,syz,sxz");
  EXPECT_FALSE(choice.of_cells);
  const auto joined = with_tensors(*mesh, choice, Take::tensor, {});
  auto* const tensors = vtkDoubleArray::SafeDownCast(joined->GetPointData()->GetArray(tensor_array));
  ASSERT_TRUE(tensors);
  for (vtkIdType i = 0; i < mesh->GetNumberOfPoints(); ++i) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> value(tensors->GetPointer(9 * i));
    EXPECT_EQ(Matrix3d(value), symmetric(Vector3d(mesh->GetPoint(i))));
  }
}

TEST(ComponentArrays, NotANumberInOneOfThemMakesTheVoxelInactive) {
  const TemporaryFolder folder;
  const auto image = image_with_components(symmetric);
  image->GetPointData()->GetArray("syz")->SetComponent(17, 0, std::numeric_limits<double>::quiet_NaN());
  write_xml(*image, folder / "file.vti");
  EXPECT_LT(difference(import_list(folder / "file.vti", "sxx,syy,szz,sxy,syz,sxz"), 59, symmetric), 1e-5);
}

TEST(ComponentArrays, AnArrayWithCommasInItsNameIsNoList) {
  const auto image = image_with_components(symmetric);
  EXPECT_TRUE(is_array_list(*image, "sxx,syy"));
  EXPECT_FALSE(is_array_list(*image, "sxx"));
  image->GetPointData()->GetArray("sxx")->SetName("sxx,syy");
  EXPECT_FALSE(is_array_list(*image, "sxx,syy"));
}

TEST(ComponentArrays, ErrorsNameTheArrayAndListTheOthers) {
  const auto image = image_with_components(symmetric);
  add_array<3>(*image, "v", [](const Vector3d& p) { return p; });
  vtkNew<vtkDoubleArray> of_cells;
  of_cells->SetName("c");
  of_cells->SetNumberOfTuples(image->GetNumberOfCells());
  of_cells->Fill(0);
  image->GetCellData()->AddArray(of_cells);
  const auto refuses = [&](const char* list, const char* part) {
    EXPECT_THAT([&] { join_arrays(*image, list); },
                ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr(part), HasSubstr("there are: sxx (1 component"))))
        << list;
  };
  refuses("sxx,syy,szz,sxy,syz", "lists 5 arrays, and a tensor has 6 or 9");
  refuses("sxx,syy,szz,sxy,syz,sxz,", "no array \"\" in the list");
  refuses("sxx,syy,szz,sxy,syz,swz", "no array \"swz\" in the list");
  refuses("sxx,syy,szz,sxy,syz,v", "array \"v\" has 3 components");
  refuses("sxx,syy,szz,sxy,syz,c", "some arrays of the list are at points, others at cells");
  EXPECT_TRUE(image->GetPointData()->HasArray("sxx"));  // a refused list changes nothing
}

}  // namespace
}  // namespace tensorray
