// Compares the generator of point loads with a field made by VTK's own source of point loads.

#include <filesystem>

#include <Eigen/Core>
#include <gtest/gtest.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkXMLImageDataReader.h>

#include "tests/data_folder.h"
#include "volumes/making/load_stress.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

TEST(PointLoad, AgreesWithTheFieldOfVtk) {
  const auto path = test::data_folder() / "pointload/pointload_32.vti";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
  vtkNew<vtkXMLImageDataReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  vtkImageData* image = reader->GetOutput();
  vtkDataArray* stress = image->GetPointData()->GetArray("stress");
  ASSERT_NE(stress, nullptr);
  ASSERT_EQ(stress->GetNumberOfComponents(), 9);
  ASSERT_EQ(image->GetNumberOfPoints(), 32 * 32 * 32);
  for (vtkIdType i = 0; i < image->GetNumberOfPoints(); ++i) {
    Vector3d position;
    Matrix3d expected;
    image->GetPoint(i, position.data());
    stress->GetTuple(i, expected.data());
    const Matrix3d tensor = point_load_stress(position - Vector3d(0, 0, 10), 100, 0.3);
    ASSERT_LE((tensor - expected).norm(), 2e-7 * expected.norm()) << position.transpose();
  }
}

}  // namespace
}  // namespace tensorray
