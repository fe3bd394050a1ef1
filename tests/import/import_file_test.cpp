#include "tools/import/import_file.h"

#include <gtest/gtest.h>
#include <vtkDoubleArray.h>
#include <vtkPointData.h>
#include <vtkPoints.h>

#include "base/process/progress.h"
#include "tests/import/mesh_files.h"
#include "tests/import/vtk_files.h"

namespace tensorray {
namespace {

/// VTK complains of each cell that it cannot invert, on every thread.
TEST(ImportFileTest, FlatCellsAreTakenInSilence) {
  const TemporaryFolder folder;
  const auto mesh = bar(0, 3);
  for (int i = 8; i < 12; ++i) mesh->GetPoints()->SetPoint(i, 1, i % 2, (i - 8) / 2);  // As those before them.
  vtkNew<vtkDoubleArray> velocity;
  velocity->SetName("velocity");
  velocity->SetNumberOfComponents(3);
  for (int i = 0; i < mesh->GetNumberOfPoints(); ++i) velocity->InsertNextTuple3(i, 2, 3);
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

TEST(ImportFileTest, NumPyVoxelsAreWhereTheUserSays) {
  const TemporaryFolder folder;
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4, 3, 3), }";
  header.resize(117, ' ');
  const std::vector<float> ones(2 * 3 * 4 * 9, 1.0F);
  write_bytes(folder / "a.npy", std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + "\n" +
                                    std::string(reinterpret_cast<const char*>(ones.data()), ones.size() * 4));
  ImportSettings settings;
  settings.files = {folder / "a.npy"};
  ImportReport report;
  EXPECT_TRUE(import_tensors(settings, Progress(), report).to_world.matrix().isIdentity());
  settings.sampling.resolution = 0.25;
  settings.origin = Eigen::Vector3d(-1, 2, 5);
  const TensorGrid grid = import_tensors(settings, Progress(), report);
  EXPECT_EQ(Eigen::Vector3d(grid.to_world * Eigen::Vector3d::Zero()), Eigen::Vector3d(-1, 2, 5));
  EXPECT_EQ(Eigen::Vector3d(grid.to_world * Eigen::Vector3d(3, 2, 1)), Eigen::Vector3d(-0.25, 2.5, 5.25));
  EXPECT_EQ(grid.active_voxels(), 24u);
  settings.voxel = Eigen::Vector3d(0.5, 0.25, 2);
  EXPECT_EQ(Eigen::Vector3d(import_tensors(settings, Progress(), report).to_world * Eigen::Vector3d(3, 2, 1)),
            Eigen::Vector3d(0.5, 2.5, 7));
  settings.voxel.reset();
  settings.sampling.bounds = Eigen::AlignedBox3d(Eigen::Vector3d(-1, 2, 5), Eigen::Vector3d(-0.75, 2.5, 5));
  EXPECT_EQ(import_tensors(settings, Progress(), report).active_voxels(), 6u);  // The bounds are in world space.
}

TEST(ImportFileTest, OnlyNumPyFilesTakeAnOrigin) {
  const TemporaryFolder folder;
  write_xml(*image(), folder / "a.vti");
  ImportSettings settings;
  settings.files = {folder / "a.vti"};
  settings.origin = Eigen::Vector3d::Zero();
  ImportReport report;
  EXPECT_THROW(import_tensors(settings, Progress(), report), std::invalid_argument);
}

}  // namespace
}  // namespace tensorray
