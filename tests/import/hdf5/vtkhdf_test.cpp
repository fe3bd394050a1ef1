// VTKHDF files, written dataset by dataset as the format prescribes.

#include <gmock/gmock.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>

#include "tests/import/hdf5_writer.h"
#include "tests/import/mesh_files.h"
#include "tests/import/vtk_files.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {
namespace {

using testing::HasSubstr;
using Ints = std::vector<int>;
using Doubles = std::vector<double>;

/// Two parts, a tetrahedron each, with a common face; and, if wanted, two steps of the values, on the same mesh.
void write_grid(const std::filesystem::path& path, bool with_steps, double version = 2) {
  Hdf5Writer file(path);
  file.group("/VTKHDF");
  file.attribute("/VTKHDF", "Version", Doubles{version, 0});
  file.attribute("/VTKHDF", "Type", "UnstructuredGrid");
  file.write("/VTKHDF/NumberOfPoints", {2}, Ints{4, 4});
  file.write("/VTKHDF/NumberOfCells", {2}, Ints{1, 1});
  file.write("/VTKHDF/NumberOfConnectivityIds", {2}, Ints{4, 4});
  file.write("/VTKHDF/Points", {8, 3}, Doubles{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1});
  file.write("/VTKHDF/Connectivity", {8}, Ints{0, 1, 2, 3, 0, 1, 2, 3});
  file.write("/VTKHDF/Offsets", {4}, Ints{0, 4, 0, 4});
  file.write("/VTKHDF/Types", {2}, Ints{10, 10});
  const int steps = with_steps ? 2 : 1;
  Doubles at_points, at_cells;
  for (int i = 0; i < 8 * steps; ++i) at_points.push_back(i);
  for (int i = 0; i < 2 * 9 * steps; ++i) at_cells.push_back(i);
  file.write("/VTKHDF/PointData/f", {static_cast<hsize_t>(8 * steps)}, at_points);
  file.write("/VTKHDF/CellData/T", {static_cast<hsize_t>(2 * steps), 9}, at_cells);
  if (!with_steps) return;
  file.group("/VTKHDF/Steps");
  file.attribute("/VTKHDF/Steps", "NSteps", Doubles{2});
  file.write("/VTKHDF/Steps/Values", {2}, Doubles{0, 0.5});
  for (const std::string name : {"PartOffsets", "PointOffsets"}) file.write("/VTKHDF/Steps/" + name, {2}, Ints{0, 0});
  file.write("/VTKHDF/Steps/NumberOfParts", {2}, Ints{2, 2});
  for (const std::string name : {"CellOffsets", "ConnectivityIdOffsets"})
    file.write("/VTKHDF/Steps/" + name, {2, 1}, Ints{0, 0});
  file.write("/VTKHDF/Steps/PointDataOffsets/f", {2}, Ints{0, 8});
  file.write("/VTKHDF/Steps/CellDataOffsets/T", {2}, Ints{0, 2});
}

TEST(VtkHdf, PartsAreMergedAndStepsAreRead) {
  const TemporaryFolder folder;
  for (const bool with_steps : {false, true}) {
    write_grid(folder / "a.vtkhdf", with_steps);
    EXPECT_EQ(time_steps(folder / "a.vtkhdf"), with_steps ? 2 : 1);
    for (const int step : {0, with_steps ? 1 : 0}) {
      const auto mesh = read_vtk_source(folder / "a.vtkhdf", step);
      ASSERT_EQ(mesh->GetNumberOfCells(), 2);
      EXPECT_EQ(mesh->GetNumberOfPoints(), 5);
      EXPECT_EQ(mesh->GetPointData()->GetArray("f")->GetComponent(4, 0), 8 * step + 7);
      EXPECT_EQ(mesh->GetCellData()->GetArray("T")->GetComponent(1, 3), 18 * step + 12);
    }
  }
}

/// An image of 3 x 2 x 2 points.
void begin_image(Hdf5Writer& file, const Doubles& version, const Doubles& origin, const Doubles& spacing) {
  file.group("/VTKHDF");
  file.attribute("/VTKHDF", "Version", version);
  file.attribute("/VTKHDF", "Type", "ImageData");
  file.attribute("/VTKHDF", "WholeExtent", Doubles{0, 2, 0, 1, 0, 1});
  file.attribute("/VTKHDF", "Origin", origin);
  file.attribute("/VTKHDF", "Spacing", spacing);
}

TEST(VtkHdf, Images) {
  const TemporaryFolder folder;
  {
    Hdf5Writer file(folder / "a.hdf");
    begin_image(file, Doubles{1, 0}, Doubles{1, 2, 3}, Doubles{0.5, 1, 2});
    Doubles values;
    for (int i = 0; i < 12 * 3; ++i) values.push_back(i);
    file.write("/VTKHDF/PointData/v", {2, 2, 3, 3}, values);
  }
  const auto image = read_vtk_source(folder / "a.hdf");
  ASSERT_TRUE(vtkImageData::SafeDownCast(image));
  EXPECT_EQ(image->GetPoint(11)[0], 2);
  EXPECT_EQ(image->GetPoint(11)[2], 5);
  EXPECT_EQ(image->GetPointData()->GetArray("v")->GetComponent(11, 2), 35);
}

/// A file with steps may have arrays that are the same at all of them, and others that name their steps.
TEST(VtkHdf, ArraysOfImagesMayStay) {
  const TemporaryFolder folder;
  {
    Hdf5Writer file(folder / "a.vtkhdf");
    begin_image(file, Doubles{2, 0}, Doubles{0, 0, 0}, Doubles{1, 1, 1});
    file.group("/VTKHDF/Steps");
    file.attribute("/VTKHDF/Steps", "NSteps", Doubles{2});
    Doubles values;
    for (int i = 0; i < 12 * 3 * 2; ++i) values.push_back(i);
    file.write("/VTKHDF/PointData/moving", {2, 2, 2, 3, 3}, values);
    file.write("/VTKHDF/PointData/named", {2, 2, 2, 3, 3}, values);
    file.write("/VTKHDF/Steps/PointDataOffsets/named", {2}, Ints{1, 0});
    values.resize(12 * 3);
    file.write("/VTKHDF/PointData/still", {2, 2, 3, 3}, values);
    file.text("/VTKHDF/PointData/label", "water");
  }
  for (const int step : {0, 1}) {
    const auto image = read_vtk_source(folder / "a.vtkhdf", step);
    for (const auto& [name, first] : {std::pair("moving", 36 * step), {"named", 36 - 36 * step}, {"still", 0}}) {
      vtkDataArray* const array = image->GetPointData()->GetArray(name);
      ASSERT_TRUE(array) << name;
      EXPECT_EQ(array->GetNumberOfComponents(), 3);
      EXPECT_EQ(array->GetComponent(11, 2), first + 35) << name << step;
    }
  }
}

TEST(VtkHdf, DamageAndOtherKindsAreErrorsWithTheFile) {
  const TemporaryFolder folder;
  const auto error = [&] { return read_error(folder / "a.vtkhdf"); };
  write_grid(folder / "a.vtkhdf", false, 3);
  EXPECT_THAT(error(), HasSubstr("a.vtkhdf: is of version 3"));
  {
    Hdf5Writer file(folder / "a.vtkhdf");
    begin_image(file, Doubles{2, 0}, Doubles{0, 0, 0}, Doubles{1, 1, 1});
    file.announce("/VTKHDF/PointData/v", {1 << 30, 1 << 20});  // None of these numbers was written.
  }
  EXPECT_THAT(error(), HasSubstr("a.vtkhdf: is damaged, or too large: it announces more than memory holds"));
  write_grid(folder / "a.vtkhdf", false);
  const std::string sound = bytes_of(folder / "a.vtkhdf");
  write_bytes(folder / "a.vtkhdf", sound.substr(0, sound.size() / 2));
  EXPECT_THAT(error(), HasSubstr("a.vtkhdf: is no HDF5 file, or cut off"));
  { Hdf5Writer(folder / "a.vtkhdf").write("/x", {1}, Ints{1}); }
  EXPECT_THAT(error(), HasSubstr("no group VTKHDF"));
  {
    Hdf5Writer file(folder / "a.vtkhdf");
    file.group("/VTKHDF");
    file.attribute("/VTKHDF", "Version", Doubles{2, 0});
    file.attribute("/VTKHDF", "Type", "PolyData");
  }
  EXPECT_THAT(error(), HasSubstr("PolyData"));
  {
    Hdf5Writer file(folder / "a.vtkhdf");
    file.group("/VTKHDF");
    file.attribute("/VTKHDF", "Version", Doubles{2, 0});
    file.attribute("/VTKHDF", "Type", "UnstructuredGrid");
    file.write("/VTKHDF/NumberOfPoints", {1}, Ints{4});
    file.write("/VTKHDF/NumberOfCells", {1}, Ints{1});
    file.write("/VTKHDF/NumberOfConnectivityIds", {1}, Ints{4});
    file.write("/VTKHDF/Points", {3, 3}, Doubles(9, 0));
  }
  EXPECT_THAT(error(), HasSubstr("Points is smaller"));
}

}  // namespace
}  // namespace tensorray
