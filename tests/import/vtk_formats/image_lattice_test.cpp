#include "tools/import/vtk_formats/image_lattice.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <vtkCell.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>

#include "tests/import/mesh_files.h"

namespace tensorray {
namespace {

/// Component c of value i is 100 i + c.
template <typename Array>
vtkSmartPointer<vtkDataArray> counting(const char* name, int components, vtkIdType tuples) {
  auto array = vtkSmartPointer<Array>::New();
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(tuples);
  for (vtkIdType i = 0; i < tuples; ++i) {
    for (int c = 0; c < components; ++c) array->SetComponent(i, c, 100.0 * static_cast<double>(i) + c);
  }
  return array;
}

vtkSmartPointer<vtkImageData> oblique_image() {
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetExtent(2, 5, -1, 1, 7, 11);  // 4 x 3 x 5
  image->SetOrigin(10, -20, 30);
  image->SetSpacing(0.5, 2, 3);
  const double c = std::cos(0.7), s = std::sin(0.7);
  image->SetDirectionMatrix(c, -s, 0, s, c, 0, 0, 0, -1);
  return image;
}

std::vector<double> read_all(const Lattice& lattice) {
  const auto slice = static_cast<std::size_t>(lattice.size.x() * lattice.size.y() * lattice.components);
  std::vector<double> values(slice * static_cast<std::size_t>(lattice.size.z()));
  for (int z = lattice.size.z() - 1; z >= 0; --z)
    lattice.read_slice(z, values.data() + static_cast<std::size_t>(z) * slice);
  return values;
}

TEST(ImageLatticeTest, PointsAreWhereVtkHasThem) {
  const auto image = oblique_image();
  const auto array = counting<vtkFloatArray>("stress", 9, image->GetNumberOfPoints());
  image->GetPointData()->AddArray(array);
  const Lattice lattice = lattice_of(image, array, false);
  EXPECT_EQ(lattice.size, Eigen::Vector3i(4, 3, 5));
  EXPECT_EQ(lattice.components, 9);
  EXPECT_EQ(lattice.array, "stress");
  EXPECT_EQ(lattice.frame, Eigen::Matrix3d::Identity());
  for (int i = 0; i < image->GetNumberOfPoints(); ++i) {
    const Eigen::Vector3d index(i % 4, i / 4 % 3, i / 12);
    const Eigen::Vector3d world = lattice.to_world * index;
    EXPECT_LT((world - Eigen::Vector3d(image->GetPoint(i))).norm(), 1e-13);
  }
  const std::vector<double> values = read_all(lattice);
  ASSERT_EQ(values.size(), 60u * 9);
  for (std::size_t i = 0; i < values.size(); ++i)
    EXPECT_EQ(values[i], 100.0 * static_cast<double>(i / 9) + static_cast<double>(i % 9));
}

TEST(ImageLatticeTest, CellsAreAtTheirCentres) {
  const auto image = oblique_image();
  const auto array = counting<vtkDoubleArray>("d", 6, image->GetNumberOfCells());
  image->GetCellData()->AddArray(array);
  const Lattice lattice = lattice_of(image, array, true);
  EXPECT_EQ(lattice.size, Eigen::Vector3i(3, 2, 4));
  for (int i = 0; i < image->GetNumberOfCells(); ++i) {
    // A cell's centre is the middle of its eight corners.
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    vtkCell* const cell = image->GetCell(i);
    for (int corner = 0; corner < 8; ++corner) centre += Eigen::Vector3d(cell->GetPoints()->GetPoint(corner)) / 8;
    const Eigen::Vector3d index(i % 3, i / 3 % 2, i / 6);
    EXPECT_LT((lattice.to_world * index - centre).norm(), 1e-13);
  }
  EXPECT_EQ(read_all(lattice)[6 * 23 + 5], 2305);
}

TEST(ImageLatticeTest, ImagesThatCannotBe) {
  const auto image = oblique_image();
  const auto array = counting<vtkFloatArray>("stress", 9, image->GetNumberOfPoints() - 1);
  EXPECT_NE(error_of([&] { lattice_of(image, array, false); }).find("59 values"), std::string::npos);
  image->SetSpacing(1, 0, 1);
  EXPECT_NE(error_of([&] { lattice_of(image, array, false); }).find("spacing"), std::string::npos);
}

}  // namespace
}  // namespace tensorray
