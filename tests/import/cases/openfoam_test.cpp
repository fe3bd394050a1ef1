// Gradients of velocities in cases of OpenFOAM: patches are walls, polyhedra are whole, processors are one mesh.

#include <functional>
#include <map>

#include <fmt/format.h>

#include "tests/import/openfoam_case.h"
#include "tests/import/velocity_meshes.h"
#include "tests/import/vtk_files.h"
#include "tools/import/meshes/cell_graph.h"
#include "tools/import/meshes/mesh_tensors.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;
namespace fs = std::filesystem;

std::string foam_row(const Vector3d& v) { return fmt::format("({:.17g} {:.17g} {:.17g})", v.x(), v.y(), v.z()); }

/// What a case says of U at its patches, by their names.
using Patches = std::map<std::string, std::string>;

/// A case of OpenFOAM with the cells and the array U of `grid`. @param patch_of  The patch of a face at a place.
void write_foam(const fs::path& folder, vtkUnstructuredGrid& grid, const Patches& patches,
                const std::function<std::string(const Vector3d&)>& patch_of) {
  std::vector<std::string> points, values;
  for (vtkIdType i = 0; i < grid.GetNumberOfPoints(); ++i) points.push_back(foam_row(Vector3d(grid.GetPoint(i))));
  std::vector<OpenFoamCase::Face> faces;
  for (vtkIdType id = 0; id < grid.GetNumberOfCells(); ++id) {
    values.push_back(foam_row(Vector3d(grid.GetCellData()->GetArray("U")->GetTuple3(id))));
    for (int i = 0; i < grid.GetCell(id)->GetNumberOfFaces(); ++i) {
      vtkCell& face = *grid.GetCell(id)->GetFace(i);
      Eigen::Matrix3Xd corners(3, face.GetNumberOfPoints());
      std::vector<int> ids;
      for (int k = 0; k < corners.cols(); ++k) {
        ids.push_back(static_cast<int>(face.GetPointId(k)));
        corners.col(k) = Vector3d(face.GetPoints()->GetPoint(k));
      }
      const FaceMeasure measure = face_measure(corners);
      if (measure.area.dot(measure.centre - middle_of(*grid.GetCell(id))) < 0) std::reverse(ids.begin(), ids.end());
      faces.push_back({ids, patch_of(measure.centre), static_cast<int>(id)});
    }
  }
  std::string entries;
  for (const auto& [patch, count] : OpenFoamCase::write_mesh(folder, points, faces))
    if (!patches.at(patch).empty()) entries += patch + "\n{\n" + patches.at(patch) + "\n}\n";
  OpenFoamCase::write_times(folder, "1");
  write_bytes(folder / "1" / "U", OpenFoamCase::head("volVectorField", "U") +
                                      "dimensions [0 1 -1 0 0 0 0];\ninternalField nonuniform List<vector>\n" +
                                      OpenFoamCase::list(values) + ";\nboundaryField\n{\n" + entries + "}\n");
}

std::string side_of_channel(const Vector3d& p) {
  return p.y() < 1e-9 ? "bottom" : p.y() > 1 - 1e-9 ? "top" : p.z() < 1e-9 || p.z() > 1 - 1e-9 ? "sides" : "ends";
}

TEST(OpenFoamWalls, PatchesOfOpenFoamAreWalls) {
  struct Row {
    const char* name;
    std::string bottom, top, ends;
    Velocity velocity;
    std::function<Matrix3d(const Vector3d&)> expected;
    std::vector<double> y;
    double tolerance = 1e-5;  ///< Of parabolas, what the rounds of the fit leave on a graded mesh.
  };
  const std::string none = "type empty;", still = "type noSlip;", open = "type zeroGradient;";
  const std::string moving = "type movingWallVelocity;\nvalue uniform (1 0 0);", symmetric = "type symmetryPlane;";
  const std::string list = "type fixedValue;\nvalue nonuniform List<vector> 4((1 0 0) (1 0 0) (1 0 0) (1 0 0));";
  const auto only = [](int i, int j, const std::function<double(double)>& value) {
    const Matrix3d unit = Vector3d::Unit(i) * Vector3d::Unit(j).transpose();
    return [=](const Vector3d& p) { return Matrix3d(value(p.y()) * unit); };
  };
  const auto one = only(0, 1, [](double) { return 1; });
  const auto couette = [](const Vector3d& p) { return Vector3d(p.y(), 0, 0); };
  const auto poiseuille = [](const Vector3d& p) { return Vector3d(p.y() * (1 - p.y()), 0, 0); };
  const auto stretch = [](const Vector3d& p) { return Vector3d(2 * p.x(), 0, 0); };
  const std::vector<double> graded{0, 0.1, 0.3, 0.6, 1};
  const std::vector<Row> rows{
      {"moving wall", still, moving, open, couette, one, graded},
      {"one cell between walls", still, list, open, couette, one, {0, 1}},
      {"one cell without walls", none, none, open, couette, only(0, 1, [](double) { return 0; }), {0, 1}},
      {"poiseuille", still, still, open, poiseuille, only(0, 1, [](double y) { return 1 - 2 * y; }), graded, 1e-3},
      {"half of it", still, open, open, [](const Vector3d& p) { return Vector3d(p.y() * (2 - p.y()), 0, 0); },
       only(0, 1, [](double y) { return 2 - 2 * y; }), graded, 1e-3},
      {"symmetry", symmetric, "type slip;", none, stretch, only(0, 0, [](double) { return 2; }), graded},
      {"no entry", "", "", open, couette, one, graded}};
  for (const Row& row : rows) {
    const TemporaryFolder folder;
    const Grid grid = boxes(steps(0, 2, 4), row.y, {0, 1});
    add_velocity(*grid, row.velocity);
    write_foam(folder, *grid, {{"bottom", row.bottom}, {"top", row.top}, {"sides", none}, {"ends", row.ends}},
               side_of_channel);
    const std::string text = bytes_of(folder / "1" / "U");
    EXPECT_LT(error_in(gradients(folder, 0.1), row.expected), row.tolerance) << row.name;
    if (row.bottom.empty()) continue;
    write_bytes(folder / "1" / "U", std::string(text).replace(text.find("bottom\n"), 6, "\"(bot|x)tom\""));
    EXPECT_LT(error_in(gradients(folder, 0.1), row.expected), row.tolerance) << row.name << ", as an expression";
  }
}

TEST(OpenFoamWalls, PolyhedraOfOpenFoamAreWhole) {
  const TemporaryFolder folder;
  const Grid grid = polyhedra();
  add_velocity(*grid, linear, middle_of);
  write_foam(folder, *grid, {{"all", "type calculated;"}}, [](const Vector3d&) { return "all"; });
  expect_linear(gradients(folder, 0.13), "polyhedra");
}

TEST(OpenFoamWalls, ProcessorsAreAsGoodAsOneCase) {
  const TemporaryFolder folder;
  const auto parabola = [](const Vector3d& p) { return Vector3d(p.y() * (1 - p.y()) + 0.1 * p.x() * p.x(), 0, 0); };
  const auto slope = [](const Vector3d& p) {
    return Matrix3d(Vector3d::UnitX() * Vector3d(0.2 * p.x(), 1 - 2 * p.y(), 0).transpose());
  };
  const std::string any = "type calculated;", seam = "type processor;\nvalue uniform (9 9 9);";
  const Patches patches{{"bottom", any}, {"top", any}, {"ends", any}, {"sides", "type slip;"}, {"procBoundary", seam}};
  const auto write = [&](const fs::path& path, double from, double to) {
    const Grid grid = boxes(steps(from, to, static_cast<int>(2 * (to - from))), steps(0, 1, 4), steps(0, 1, 3));
    add_velocity(*grid, parabola);
    write_foam(path, *grid, patches,
               [&](const Vector3d& p) { return p.x() == 2 && to - from < 4 ? "procBoundary" : side_of_channel(p); });
  };
  write(folder / "whole", 0, 4);
  write(folder / "parts" / "processor0", 0, 2);
  write(folder / "parts" / "processor1", 2, 4);
  fs::rename(folder / "parts" / "processor0" / "system", folder / "parts" / "system");
  const TensorGrid whole = gradients(folder / "whole", 0.2);
  expect_alike(gradients(folder / "parts", 0.2), whole, "parts");
  EXPECT_LT(error_in(whole, slope), 1e-3);
}

// OpenFOAM cases that are decomposed, or of several regions.
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
      if (file.empty()) file = "/* a banner */\n" + OpenFoamCase::head("decomposedBlockData", "all") + "\n";
      file += fmt::format("// Processor{}\n\n{}\n({})\n\n", processor, part.size(), part);
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
    const Vector3i at = middle_of(*read->GetCell(cell)).cwiseQuotient(Vector3d(1, 0.5, 2)).cast<int>();
    const int number = OpenFoamCase::cells * (at.x() / 2) + at.x() % 2 + 2 * at.y() + 4 * at.z();
    EXPECT_EQ(U.GetComponent(cell, 1), OpenFoamCase::value(number, 1, at_end));
  }
  // The middle of the seam has the mean of all eight cells about it.
  const vtkIdType middle = read->FindPoint(2, 0.5, 2);
  const double mean = (OpenFoamCase::value(4, 0, at_end) + OpenFoamCase::value(11, 0, at_end)) / 2;
  const auto tensors = with_tensors(*read, {"sigma", true}, Take::tensor, {});
  EXPECT_NEAR(tensors->GetPointData()->GetArray(tensor_array)->GetComponent(middle, 0), mean, 1e-3);
}

TEST(OpenFoamParts, DecomposedCasesAreMergedAlsoFromCollatedFiles) {
  using Collate = void (*)(const fs::path& folder);
  for (const Collate collate_all : {Collate([](const fs::path& folder) { write_bytes(folder / "case.foam", ""); }),
                                    Collate([](const fs::path& folder) { collate(folder, 0, 1, "processors2"); }),
                                    Collate([](const fs::path& folder) {
                                      collate(folder, 0, 0, "processors2_0-0");
                                      collate(folder, 1, 1, "processors2_1-1");
                                    })}) {
    const TemporaryFolder folder;
    write_decomposed(folder);
    collate_all(folder);
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
  EXPECT_THAT(read_error(folder), HasSubstr("no time folder that all of its"));
  fs::rename(folder / "processor1", folder / "processor2");
  EXPECT_THAT(read_error(folder), HasSubstr("processor1: is missing"));
}

TEST(OpenFoamParts, DamagedCollatedFilesAreErrorsWithTheFile) {
  const TemporaryFolder folder;
  write_decomposed(folder);
  collate(folder, 0, 1, "processors2");
  const fs::path points = folder / "processors2/constant/polyMesh/points";
  const std::string sound = bytes_of(points);
  for (const std::string& damaged : {sound.substr(0, sound.size() / 2), sound.substr(0, sound.size() - 4)}) {
    write_bytes(points, damaged);
    EXPECT_THAT(read_error(folder), HasSubstr("points: is damaged"));
  }
  fs::remove(points);
  EXPECT_THAT(read_error(folder), HasSubstr("points: is missing"));
}

TEST(OpenFoamParts, RegionsKeepTheirOwnValuesWhereTheyMeet) {
  const TemporaryFolder folder;
  OpenFoamCase::write(folder / "fluid", 0);
  OpenFoamCase::write(folder / "solid", 1);
  fs::rename(folder / "fluid" / "system", folder / "system");
  for (const std::string region : {"fluid", "solid"}) {
    for (const std::string place : {"constant", "0", "0.5"}) {
      fs::create_directories(folder / place);
      fs::rename(folder / region / place, folder / place / region);
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
