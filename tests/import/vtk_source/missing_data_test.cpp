// Cells and points without data leave a hole of their own size; all kinds of data sets treat ghosts alike.

#include <limits>

#include <vtkCellData.h>
#include <vtkIntArray.h>
#include <vtkUnsignedCharArray.h>

#include "base/process/progress.h"
#include "tests/import/mesh_files.h"
#include "tests/import/mesh_fixtures.h"
#include "tests/import/vtk_files.h"
#include "tools/import/import_file.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;

const double nan = std::numeric_limits<double>::quiet_NaN();

TensorGrid import_voxels(const std::filesystem::path& file, const std::string& array, Take take = Take::tensor,
                         CellValues values = CellValues::linear) {
  ImportSettings settings;
  settings.files = {file};
  settings.array = array;
  settings.take = take;
  settings.cell_values = values;
  settings.sampling.resolution = 0.5;
  ImportReport report;
  return import_tensors(settings, Progress(), report);
}

/// @return for each active voxel: its place.
std::vector<Vector3d> active_voxels(const std::filesystem::path& file, const std::string& array,
                                    Take take = Take::tensor, CellValues values = CellValues::linear) {
  std::vector<Vector3d> places;
  for_each_voxel(import_voxels(file, array, take, values),
                 [&](const Vector3d& p, const Matrix3d&) { places.push_back(p); });
  return places;
}

/// How many of them are at x <= 2.
std::size_t in_first_half(const std::vector<Vector3d>& places) {
  return static_cast<std::size_t>(
      std::count_if(places.begin(), places.end(), [](const Vector3d& p) { return p.x() < 2.01; }));
}

/// A block of 4 x 2 x 2 unit cubes, or a part of it along x.
vtkSmartPointer<vtkUnstructuredGrid> cubes(int from = 0, int to = 4) {
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  const int n = to - from + 1;
  for (int i = 0; i < 9 * n; ++i) points->InsertNextPoint(from + i % n, i / n % 3, i / n / 3);
  grid->SetPoints(points);
  for (int z = 0; z < 2; ++z)
    for (int y = 0; y < 2; ++y)
      for (int x = 0; x + 1 < n; ++x) {
        const auto p = [&](int a, int b, int c) { return vtkIdType{(z + c) * 3 * n + (y + b) * n + x + a}; };
        const vtkIdType ids[] = {p(0, 0, 0), p(1, 0, 0), p(1, 1, 0), p(0, 1, 0),
                                 p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)};
        grid->InsertNextCell(VTK_HEXAHEDRON, 8, ids);
      }
  return grid;
}

/// Adds an array of ones, except for where `missing` tells that there is no number.
void add_ones(vtkDataSetAttributes& data, vtkDataSet& mesh, const char* name, int components, bool of_cells,
              const std::function<bool(double x)>& missing) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(of_cells ? mesh.GetNumberOfCells() : mesh.GetNumberOfPoints());
  for (vtkIdType i = 0; i < array->GetNumberOfTuples(); ++i) {
    const double x =
        of_cells ? 0.5 * (mesh.GetCell(i)->GetBounds()[0] + mesh.GetCell(i)->GetBounds()[1]) : mesh.GetPoint(i)[0];
    for (int c = 0; c < components; ++c) array->SetComponent(i, c, missing(x) ? nan : 1 + c);
  }
  data.AddArray(array);
}

constexpr std::size_t half = 5 * 5 * 5, whole = 9 * 5 * 5;

TEST(MissingData, CellsWithoutItDoNotDeleteTheirNeighbours) {
  const TemporaryFolder folder;
  const auto mesh = cubes();
  add_ones(*mesh->GetCellData(), *mesh, "T", 9, true, [](double x) { return x > 2; });
  write_xml(*mesh, folder / "a.vtu");
  for (const CellValues values : {CellValues::linear, CellValues::constant}) {
    const auto places = active_voxels(folder / "a.vtu", "T", Take::tensor, values);
    EXPECT_EQ(in_first_half(places), half);
    EXPECT_EQ(places.size(), half);
  }
}

TEST(MissingData, OneCellIsOneHole) {
  const TemporaryFolder folder;
  const auto mesh = cubes();
  add_ones(*mesh->GetCellData(), *mesh, "T", 9, true, [](double) { return false; });
  mesh->GetCellData()->GetArray("T")->SetComponent(1, 4, nan);
  write_xml(*mesh, folder / "a.vtu");
  EXPECT_EQ(active_voxels(folder / "a.vtu", "T").size(), whole - 4u);  // Its inner voxel, and those of the outer faces.
}

/// Writes a .vtm of two halves of the block, of which the array T of the second has another type or other names.
std::filesystem::path write_halves(const std::filesystem::path& folder, vtkDataSet& first, vtkDataSet& second) {
  write_xml(first, folder / "first.vtu");
  write_xml(second, folder / "second.vtu");
  write_bytes(folder / "a.vtm",
              "<VTKFile type=\"vtkMultiBlockDataSet\"><vtkMultiBlockDataSet><DataSet file=\"first.vtu\"/>"
              "<DataSet file=\"second.vtu\"/></vtkMultiBlockDataSet></VTKFile>\n");
  return folder / "a.vtm";
}

TEST(MissingData, APieceWithoutTheArrayIsAHole) {
  const TemporaryFolder folder;
  for (const bool of_cells : {true, false}) {
    const auto first = cubes(0, 2), second = cubes(2, 4);
    auto& data = of_cells ? static_cast<vtkDataSetAttributes&>(*first->GetCellData()) : *first->GetPointData();
    add_ones(data, *first, "T", 9, of_cells, [](double) { return false; });
    for (const bool swapped : {false, true}) {
      const auto places =
          active_voxels(write_halves(folder, swapped ? *second : *first, swapped ? *first : *second), "T");
      EXPECT_EQ(in_first_half(places), half) << of_cells;
      EXPECT_EQ(places.size(), half) << of_cells;
    }
  }
}

TEST(MissingData, DerivativesDoNotLookAtIt) {
  const TemporaryFolder folder;
  const auto mesh = cubes();
  add_ones(*mesh->GetPointData(), *mesh, "v", 3, false, [](double x) { return x > 2.5; });
  write_xml(*mesh, folder / "a.vtu");
  const auto places = active_voxels(folder / "a.vtu", "v", Take::gradient);
  EXPECT_EQ(in_first_half(places), half);
  EXPECT_EQ(places.size(), half);
}

/// 4 x 2 x 2 cubes as a data set of each kind.
std::vector<std::pair<std::string, vtkSmartPointer<vtkDataSet>>> kinds_of_cubes() {
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(5, 3, 3);
  auto rectilinear = vtkSmartPointer<vtkRectilinearGrid>::New();
  vtkNew<vtkDoubleArray> x, y;
  for (int i = 0; i < 5; ++i) x->InsertNextValue(i);
  for (int i = 0; i < 3; ++i) y->InsertNextValue(i);
  rectilinear->SetDimensions(5, 3, 3);
  rectilinear->SetXCoordinates(x);
  rectilinear->SetYCoordinates(y);
  rectilinear->SetZCoordinates(y);
  const auto structured =
      curvilinear({5, 3, 3}, [](const Vector3d& p) { return Vector3d(4 * p.x(), 2 * p.y(), 2 * p.z()); });
  return {{".vti", image}, {".vtr", rectilinear}, {".vts", structured}, {".vtu", cubes()}};
}

void mark(vtkDataSetAttributes& data, vtkIdType count, unsigned char bit, const std::function<bool(vtkIdType)>& which) {
  vtkNew<vtkUnsignedCharArray> ghosts;
  ghosts->SetName(vtkDataSetAttributes::GhostArrayName());
  for (vtkIdType i = 0; i < count; ++i) ghosts->InsertNextValue(which(i) ? bit : static_cast<unsigned char>(0));
  data.AddArray(ghosts);
}

// Rows of the table: what is marked; columns: the kinds of data sets, and whether the tensors are at points or cells.
TEST(Ghosts, EachKindOfDataSetTreatsThemAlike) {
  const TemporaryFolder folder;
  struct Row {
    const char* name;
    bool of_cells;  ///< Whether cells are marked, or points.
    unsigned char bit;
    std::size_t voxels;  ///< Active ones of edge 1/2.
  };
  // Cells at 2 < x < 4 are marked, or the points at x = 3 and 4. A voxel on a face of a cell that is used is in it.
  const Row table[] = {{"hidden cells", true, vtkDataSetAttributes::HIDDENCELL, half},
                       {"refined cells", true, vtkDataSetAttributes::REFINEDCELL, half},
                       {"copies of cells", true, vtkDataSetAttributes::DUPLICATECELL, whole},
                       {"hidden points", false, vtkDataSetAttributes::HIDDENPOINT, half},
                       {"copies of points", false, vtkDataSetAttributes::DUPLICATEPOINT, whole}};
  for (const Row& row : table)
    for (const auto& [ending, set] : kinds_of_cubes())
      for (const bool at_cells : {false, true})
        for (const CellValues values : {CellValues::linear, CellValues::constant}) {
          if (!at_cells && values == CellValues::constant) continue;
          auto& data = at_cells ? static_cast<vtkDataSetAttributes&>(*set->GetCellData()) : *set->GetPointData();
          add_ones(data, *set, "T", 9, at_cells, [](double) { return false; });
          if (row.of_cells)
            mark(*set->GetCellData(), set->GetNumberOfCells(), row.bit, [](vtkIdType i) { return i % 4 >= 2; });
          else
            mark(*set->GetPointData(), set->GetNumberOfPoints(), row.bit, [](vtkIdType i) { return i % 5 >= 3; });
          write_xml(*set, folder / ("a" + ending));
          const auto places = active_voxels(folder / ("a" + ending), "T", Take::tensor, values);
          EXPECT_EQ(places.size(), row.voxels) << row.name << ending << (at_cells ? " at cells" : " at points");
          EXPECT_EQ(in_first_half(places), half) << row.name << ending << (at_cells ? " at cells" : " at points");
          data.RemoveArray("T");
          set->GetCellData()->RemoveArray(vtkDataSetAttributes::GhostArrayName());
          set->GetPointData()->RemoveArray(vtkDataSetAttributes::GhostArrayName());
        }
}

TEST(Ghosts, DerivativesDoNotLookAtHiddenPointsOfAnyKindOfDataSet) {
  const TemporaryFolder folder;
  for (const auto& kind : kinds_of_cubes()) {
    const auto& ending = kind.first;  // No structured binding: a lambda below captures it.
    const auto& set = kind.second;
    add_array<3>(*set, "v",
                 [](const Vector3d& p) { return Vector3d(p.x() < 2.5 ? p.x() : 1e6, 2 * p.y(), 3 * p.z()); });
    mark(*set->GetPointData(), set->GetNumberOfPoints(), vtkDataSetAttributes::HIDDENPOINT,
         [](vtkIdType i) { return i % 5 >= 3; });
    write_xml(*set, folder / ("a" + ending));
    std::size_t voxels = 0;
    for_each_voxel(import_voxels(folder / ("a" + ending), "v", Take::gradient),
                   [&](const Vector3d&, const Matrix3d& gradient) {
                     ++voxels;
                     EXPECT_LT((gradient - Matrix3d(Vector3d(1, 2, 3).asDiagonal())).norm(), 1e-5) << ending;
                   });
    EXPECT_EQ(voxels, half) << ending;
  }
}

/// Images whose voxels are kept do the same: of points, those that no used cell has are not there.
TEST(Ghosts, VoxelsThatAreKeptAreHiddenAsInAMesh) {
  const TemporaryFolder folder;
  const auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(5, 3, 3);
  const auto count = [&](bool at_cells) {
    auto& data = at_cells ? static_cast<vtkDataSetAttributes&>(*image->GetCellData()) : *image->GetPointData();
    add_ones(data, *image, "T", 9, at_cells, [](double) { return false; });
    write_xml(*image, folder / "a.vti");
    data.RemoveArray("T");
    ImportSettings settings;
    settings.files = {folder / "a.vti"};
    ImportReport report;
    return import_tensors(settings, Progress(), report).active_voxels();
  };
  mark(*image->GetCellData(), 16, vtkDataSetAttributes::HIDDENCELL, [](vtkIdType i) { return i % 4 >= 2; });
  EXPECT_EQ(count(false), 3u * 3 * 3);
  EXPECT_EQ(count(true), 2u * 2 * 2);
  image->GetCellData()->RemoveArray(vtkDataSetAttributes::GhostArrayName());
  mark(*image->GetPointData(), 45, vtkDataSetAttributes::HIDDENPOINT, [](vtkIdType i) { return i % 5 >= 3; });
  EXPECT_EQ(count(false), 3u * 3 * 3);
  EXPECT_EQ(count(true), 2u * 2 * 2);
}

TEST(MissingData, PointsOfTwoPiecesTakeTheFiniteValues) {
  const TemporaryFolder folder;
  const auto first = cubes(0, 2), second = cubes(2, 4);
  add_ones(*first->GetPointData(), *first, "T", 9, false, [](double) { return true; });
  add_ones(*second->GetPointData(), *second, "T", 9, false, [](double) { return false; });
  EXPECT_EQ(active_voxels(write_halves(folder, *first, *second), "T").size(), half);
  EXPECT_EQ(active_voxels(write_halves(folder, *second, *first), "T").size(), half);
}

TEST(MissingData, PiecesMayHaveNumbersOfOtherTypes) {
  const TemporaryFolder folder;
  const auto first = cubes(0, 2), second = cubes(2, 4);
  add_ones(*first->GetPointData(), *first, "T", 9, false, [](double) { return false; });
  add_ones(*second->GetPointData(), *second, "T", 9, false, [](double) { return false; });
  vtkNew<vtkIntArray> integers;
  integers->DeepCopy(first->GetPointData()->GetArray("T"));
  first->GetPointData()->AddArray(integers);
  EXPECT_EQ(active_voxels(write_halves(folder, *first, *second), "T").size(), whole);
  second->GetPointData()->RemoveArray("T");
  EXPECT_EQ(active_voxels(write_halves(folder, *first, *second), "T").size(), half);  // Not zeros.
}

TEST(MissingData, PiecesMayHaveComponentsInOtherOrders) {
  const TemporaryFolder folder;
  const auto first = cubes(0, 2), second = cubes(2, 4);
  const auto add = [](vtkDataSet& mesh, const std::vector<const char*>& names, const Eigen::Matrix<double, 6, 1>& v) {
    add_array<6>(mesh, "S", [&](const Vector3d&) { return v; });
    for (int i = 0; i < 6; ++i)
      mesh.GetPointData()->GetArray("S")->SetComponentName(i, names[static_cast<std::size_t>(i)]);
  };
  add(*first, {"s_xx", "s_xy", "s_xz", "s_yy", "s_yz", "s_zz"},
      (Eigen::Matrix<double, 6, 1>() << 1, 4, 6, 2, 5, 3).finished());
  add(*second, {"XX", "YY", "ZZ", "XY", "YZ", "XZ"}, (Eigen::Matrix<double, 6, 1>() << 1, 2, 3, 4, 5, 6).finished());
  const TensorGrid grid = import_voxels(write_halves(folder, *first, *second), "S");
  const Matrix3d expected = (Matrix3d() << 1, 4, 6, 4, 2, 5, 6, 5, 3).finished();
  for_each_voxel(grid, [&](const Vector3d& p, const Matrix3d& tensor) {
    EXPECT_LT((tensor - expected).norm(), 1e-5) << p.transpose();
  });
}

}  // namespace
}  // namespace tensorray
