#include "tools/import/import_file.h"

#include <gtest/gtest.h>
#include <vtkDoubleArray.h>
#include <vtkPointData.h>
#include <vtkPoints.h>

#include "base/progress.h"
#include "tests/import/mesh_files.h"
#include "tests/import/vtk_files.h"

namespace tensorray {
namespace {

/// VTK complains of each cell that it cannot invert, on every thread.
TEST(ImportFileTest, FlatCellsAreTakenInSilence) {
  const TemporaryFolder folder;
  const auto mesh = bar(0, 3);
  for (vtkIdType i = 8; i < 12; ++i) mesh->GetPoints()->SetPoint(i, 1, i % 2, (i - 8) / 2);  // As those before them.
  vtkNew<vtkDoubleArray> velocity;
  velocity->SetName("velocity");
  velocity->SetNumberOfComponents(3);
  for (vtkIdType i = 0; i < mesh->GetNumberOfPoints(); ++i) velocity->InsertNextTuple3(i, 2, 3);
  mesh->GetPointData()->AddArray(velocity);
  write_xml(*mesh, folder / "a.vtu");
  ImportSettings settings;
  settings.files = {folder / "a.vtu"};
  settings.array = "velocity";
  settings.take = Take::gradient;
  settings.sampling.resolution = 5;
  ImportReport report;
  testing::internal::CaptureStderr();
  error_of([&] { import_tensors(settings, Progress(), report); });
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace tensorray
