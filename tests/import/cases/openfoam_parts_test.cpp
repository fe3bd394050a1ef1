// OpenFOAM cases that are decomposed, or of several regions.

#include <map>

#include <gmock/gmock.h>
#include <vtkCellData.h>
#include <vtkPointData.h>

#include "tests/import/mesh_files.h"
#include "tests/import/openfoam_case.h"
#include "tests/import/vtk_files.h"
#include "tools/import/meshes/mesh_tensors.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

/// A case of two processors, side by side along x.
void write_decomposed(const fs::path& folder) {
  for (const int processor : {0, 1}) OpenFoamCase::write(folder / ("processor" + std::to_string(processor)), processor);
  if (!fs::exists(folder / "system")) fs::copy(folder / "processor0" / "system", folder / "system");
  for (const char* processor : {"processor0", "processor1"}) fs::remove_all(folder / processor / "system");
}

/// Joins the files of the processors from `first` to `last` to those of `target`, as OpenFOAM collates them: only the
/// first part has a header.
void collate(const fs::path& folder, int first, int last, const std::string& target) {
  std::map<fs::path, std::string> contents;
  for (int processor = first; processor <= last; ++processor) {
    const fs::path from = folder / ("processor" + std::to_string(processor));
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(from)) {
      if (!entry.is_regular_file()) continue;
      std::string part = bytes_of(entry.path());
      if (processor > first) part.erase(0, part.find('}') + 1);
      std::string& file = contents[fs::relative(entry.path(), from)];
      if (file.empty())
        file =
            "/* a banner */\nFoamFile\n{\n    version 2.0;\n    format ascii;\n    class decomposedBlockData;\n}\n\n";
      file +=
          "// Processor" + std::to_string(processor) + "\n\n" + std::to_string(part.size()) + "\n(" + part + ")\n\n";
    }
    fs::remove_all(from);
  }
  for (const auto& [name, file] : contents) write_bytes(folder / target / name, file);
}

/// Cells have the values of their numbers; which cell is where tells the order of the merged ones.
void expect_both_parts(const fs::path& folder, std::optional<int> step = {}) {
  const auto read = read_vtk_source(folder, step);
  ASSERT_EQ(read->GetNumberOfCells(), 2 * OpenFoamCase::cells);
  EXPECT_EQ(read->GetNumberOfPoints(), 27 + 27 - 9);  // The points between the processors are merged.
  const int at_end = step.value_or(1);
  vtkDataArray& U = *read->GetCellData()->GetArray("U");
  for (int cell = 0; cell < 2 * OpenFoamCase::cells; ++cell) {
    double bounds[6];
    read->GetCellBounds(cell, bounds);
    const int part = bounds[0] < 1.5 ? 0 : 1, i = static_cast<int>(bounds[0]) - 2 * part, j = bounds[2] < 0.25 ? 0 : 1,
              k = bounds[4] < 1 ? 0 : 1;
    const int number = OpenFoamCase::cells * part + i + 2 * j + 4 * k;
    EXPECT_EQ(U.GetComponent(cell, 1), OpenFoamCase::value(number, 1, at_end));
  }
  // The middle of the seam has the mean of all eight cells about it.
  const vtkIdType middle = read->FindPoint(2, 0.5, 2);
  const double mean = (OpenFoamCase::value(4, 0, at_end) + OpenFoamCase::value(11, 0, at_end)) / 2;
  const auto tensors = with_tensors(*read, {"sigma", true}, Take::tensor, {});
  EXPECT_NEAR(tensors->GetPointData()->GetArray(tensor_array)->GetComponent(middle, 0), mean, 1e-3);
}

TEST(OpenFoamParts, DecomposedCasesAreMerged) {
  const TemporaryFolder folder;
  write_decomposed(folder);
  EXPECT_EQ(time_steps(folder), 2);
  expect_both_parts(folder);
  expect_both_parts(folder, 0);
  write_bytes(folder / "case.foam", "");
  expect_both_parts(folder);
}

TEST(OpenFoamParts, CollatedFilesAreDivided) {
  for (const bool in_groups : {false, true}) {
    const TemporaryFolder folder;
    write_decomposed(folder);
    if (!in_groups) collate(folder, 0, 1, "processors2");
    if (in_groups) {
      collate(folder, 0, 0, "processors2_0-0");
      collate(folder, 1, 1, "processors2_1-1");
    }
    EXPECT_EQ(time_steps(folder), 2);
    expect_both_parts(folder);
    expect_both_parts(folder, 0);
  }
}

TEST(OpenFoamParts, TheLaterTimesOfProcessorsAreTaken) {
  const TemporaryFolder folder;
  OpenFoamCase::write(folder);
  write_decomposed(folder);
  EXPECT_EQ(read_vtk_source(folder)->GetNumberOfCells(), OpenFoamCase::cells);  // Reconstructed: the same times.
  fs::remove_all(folder / "0.5");
  expect_both_parts(folder);
}

/// A run that goes on may have written its last time in part; and a processor may be lost.
TEST(OpenFoamParts, ATimeIsOneOfAllProcessors) {
  const TemporaryFolder folder;
  write_decomposed(folder);
  fs::remove_all(folder / "processor1" / "0.5");
  EXPECT_EQ(time_steps(folder), 1);
  expect_both_parts(folder, 0);
  EXPECT_EQ(read_vtk_source(folder)->GetCellData()->GetArray("U")->GetComponent(0, 0), OpenFoamCase::value(0, 0, 0));
  fs::remove_all(folder / "processor1" / "0");
  EXPECT_NE(read_error(folder).find("no time folder that all of its"), std::string::npos);
  fs::rename(folder / "processor1", folder / "processor2");
  EXPECT_NE(read_error(folder).find("processor1: is missing"), std::string::npos);
}

TEST(OpenFoamParts, DamagedCollatedFilesAreErrorsWithTheFile) {
  const TemporaryFolder folder;
  write_decomposed(folder);
  collate(folder, 0, 1, "processors2");
  const fs::path points = folder / "processors2/constant/polyMesh/points";
  const std::string sound = bytes_of(points);
  for (const std::string& damaged : {sound.substr(0, sound.size() / 2), sound.substr(0, sound.size() - 4)}) {
    write_bytes(points, damaged);
    EXPECT_NE(read_error(folder).find("points: is damaged"), std::string::npos);
  }
  fs::remove(points);
  EXPECT_NE(read_error(folder).find("points: is missing"), std::string::npos);
}

TEST(OpenFoamParts, RegionsKeepTheirOwnValuesWhereTheyMeet) {
  const TemporaryFolder folder;
  OpenFoamCase::write(folder / "fluid", 0);
  OpenFoamCase::write(folder / "solid", 1);
  fs::rename(folder / "fluid" / "system", folder / "system");
  for (const std::string region : {"fluid", "solid"}) {
    fs::create_directories(folder / "constant" / region);
    fs::rename(folder / region / "constant" / "polyMesh", folder / "constant" / region / "polyMesh");
    for (const std::string time : {"0", "0.5"}) {
      fs::create_directories(folder / time);
      fs::rename(folder / region / time, folder / time / region);
    }
    fs::remove_all(folder / region);
  }
  for (const std::string time : {"0", "0.5"}) fs::remove(folder / time / "solid" / "U");
  const auto read = read_vtk_source(folder);
  ASSERT_EQ(read->GetNumberOfCells(), 2 * OpenFoamCase::cells);
  EXPECT_EQ(read->GetNumberOfPoints(), 27 + 27);
  const auto gradients = with_tensors(*read, {"U", true}, Take::gradient, {});
  int with_U = 0;
  for (vtkIdType i = 0; i < read->GetNumberOfPoints(); ++i)
    if (std::isfinite(gradients->GetPointData()->GetArray(tensor_array)->GetComponent(i, 0))) ++with_U;
  EXPECT_EQ(with_U, 27);  // Also those at the solid, which has no U.
}

}  // namespace
}  // namespace tensorray
