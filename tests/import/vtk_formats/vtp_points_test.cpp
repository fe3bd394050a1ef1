// Points as VTK polydata, as VTK reads them.

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkCellArray.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataReader.h>

#include "tests/import/mesh_files.h"
#include "tests/volumes/file_size_limit.h"
#include "tests/volumes/point_support.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(VtpPoints, HoldEveryPointAndAttribute) {
  const PointCloud cloud = cloud_of(3000, 0);
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "a.vtp";
  write_points(path, cloud);
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  vtkPolyData* read = reader->GetOutput();
  ASSERT_EQ(read->GetNumberOfPoints(), 3000);
  ASSERT_EQ(read->GetNumberOfVerts(), 3000);
  EXPECT_STREQ(read->GetPointData()->GetScalars()->GetName(), "wavelength");  // What ParaView shows at first.
  vtkIdType size = 0;
  const vtkIdType* points = nullptr;
  read->GetVerts()->GetCellAtId(1234, size, points);
  EXPECT_EQ(size, 1);
  EXPECT_EQ(points[0], 1234);
  std::vector<Record> records;
  const auto vector = [](const double* v) { return Eigen::Vector3d(v[0], v[1], v[2]).cast<float>().eval(); };
  for (vtkIdType i = 0; i < 3000; ++i)
    records.emplace_back(static_cast<float>(read->GetPointData()->GetArray("power")->GetTuple1(i)),
                         vector(read->GetPoint(i)),
                         static_cast<float>(read->GetPointData()->GetArray("wavelength")->GetTuple1(i)),
                         vector(read->GetPointData()->GetArray("direction")->GetTuple3(i)));
  expect_records(records, cloud, 0);
  for (const auto& [key, value] : cloud.metadata) {
    auto* text = vtkStringArray::SafeDownCast(read->GetFieldData()->GetAbstractArray(key.c_str()));
    ASSERT_NE(text, nullptr) << key;
    EXPECT_EQ(text->GetValue(0), value);
  }
}

TEST(VtpPoints, FullDiskIsNoticed) {
  const PointCloud cloud = cloud_of(20000, 0.5f);
  const TemporaryFolder folder;
  const fs::path path = folder / "a.vtp";
  write_points(path, cloud);
  const auto size = fs::file_size(path);
  for (const auto limit : {std::uintmax_t{0}, size / 50, size / 3, size / 2, size * 9 / 10, size - 1}) {
    fs::remove(path);
    const FileSizeLimit limited(limit);
    testing::internal::CaptureStderr();
    const std::string error = error_of([&] { write_points(path, cloud); });
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_THAT(error, HasSubstr(path.string() + ": cannot be written: ")) << limit << " of " << size;
  }
}

}  // namespace
}  // namespace tensorray
