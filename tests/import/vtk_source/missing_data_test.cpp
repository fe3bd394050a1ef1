// Cells and points without data leave a hole of their own size; all kinds of data sets treat ghosts alike.

#include <array>

#include <vtkIntArray.h>
#include <vtkUnsignedCharArray.h>

#include "tests/import/velocity_meshes.h"
#include "tests/import/vtk_files.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;
using Vector6d = Eigen::Matrix<double, 6, 1>;

ImportSettings half_voxels(const std::string& array, Take take = Take::tensor, CellValues values = CellValues::linear) {
  ImportSettings settings = array_settings(array, take, 0.5);
  settings.cell_values = values;
  return settings;
}

/// A block of 4 x 2 x 2 unit cubes, or a part of it along x.
Grid cubes(int from = 0, int to = 4) { return boxes(steps(from, to, to - from), {0, 1, 2}, {0, 1, 2}); }

vtkDataSetAttributes& data_of(vtkDataSet& set, bool of_cells) {
  return *set.GetAttributes(of_cells ? vtkDataObject::CELL : vtkDataObject::POINT);
}

bool nowhere(double) { return false; }

/// Adds an array of ones, except for where `missing` tells that there is no number.
void add_ones(vtkDataSet& mesh, const char* name, int components, bool of_cells, bool (*missing)(double x) = nowhere) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(of_cells ? mesh.GetNumberOfCells() : mesh.GetNumberOfPoints());
  for (vtkIdType i = 0; i < array->GetNumberOfTuples(); ++i) {
    const double x = of_cells ? middle_of(*mesh.GetCell(i)).x() : mesh.GetPoint(i)[0];
    for (int c = 0; c < components; ++c) array->SetComponent(i, c, missing(x) ? NAN : 1.0 + c);
  }
  data_of(mesh, of_cells).AddArray(array);
}

constexpr std::size_t half = 5 * 5 * 5, whole = 9 * 5 * 5;

using Counts = std::pair<std::size_t, std::size_t>;

/// The numbers of active voxels at x <= 2, and of all.
Counts voxels_of(const std::filesystem::path& file, const ImportSettings& settings) {
  Counts counts;
  for_each_voxel(imported(file, settings).grid, [&](const Vector3d& p, const Matrix3d&) {
    counts.first += p.x() < 2.01;
    ++counts.second;
  });
  return counts;
}

TEST(MissingData, NeighboursOfCellsWithoutItRemainAndDerivativesDoNotLookAtIt) {
  const TemporaryFolder folder;
  const auto mesh = cubes();
  add_ones(*mesh, "T", 9, true, [](double x) { return x > 2; });
  add_ones(*mesh, "v", 3, false, [](double x) { return x > 2.5; });
  write_xml(*mesh, folder / "a.vtu");
  for (const ImportSettings& settings :
       {half_voxels("T"), half_voxels("T", Take::tensor, CellValues::constant), half_voxels("v", Take::gradient)})
    EXPECT_EQ(voxels_of(folder / "a.vtu", settings), Counts(half, half)) << settings.array;
}

TEST(MissingData, OneCellIsOneHole) {
  const TemporaryFolder folder;
  const auto mesh = cubes();
  add_ones(*mesh, "T", 9, true);
  mesh->GetCellData()->GetArray("T")->SetComponent(1, 4, NAN);
  write_xml(*mesh, folder / "a.vtu");
  // Its inner voxel, and those of the outer faces.
  EXPECT_EQ(imported(folder / "a.vtu", half_voxels("T")).voxels(), whole - 4u);
}

/// Writes a .vtm of two halves of the block, of which the array T of the second has another type or other names.
std::filesystem::path write_halves(const std::filesystem::path& folder, vtkDataSet& first, vtkDataSet& second) {
  write_xml(first, folder / "first.vtu");
  write_xml(second, folder / "second.vtu");
  write_bytes(folder / "a.vtm", blocks_of({"first.vtu", "second.vtu"}));
  return folder / "a.vtm";
}

TEST(MissingData, APieceWithoutTheArrayIsAHole) {
  const TemporaryFolder folder;
  for (const bool of_cells : {true, false}) {
    const auto first = cubes(0, 2), second = cubes(2, 4);
    add_ones(*first, "T", 9, of_cells);
    EXPECT_EQ(voxels_of(write_halves(folder, *first, *second), half_voxels("T")), Counts(half, half)) << of_cells;
    EXPECT_EQ(voxels_of(write_halves(folder, *second, *first), half_voxels("T")), Counts(half, half)) << of_cells;
  }
}

/// 4 x 2 x 2 cubes as a data set of each kind.
std::vector<std::pair<std::string, vtkSmartPointer<vtkDataSet>>> kinds_of_cubes() {
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(5, 3, 3);
  const auto rectilinear = rectilinear_grid({0, 1, 2, 3, 4}, {0, 1, 2}, {0, 1, 2});
  const auto structured = curvilinear({5, 3, 3}, [](const Vector3d& p) { return Vector3d(4, 2, 2).cwiseProduct(p); });
  return {{".vti", image}, {".vtr", rectilinear}, {".vts", structured}, {".vtu", cubes()}};
}

/// Marks the cells at 2 < x < 4, or the points at x = 3 and 4.
void mark(vtkDataSet& set, bool of_cells, unsigned char bit) {
  vtkNew<vtkUnsignedCharArray> ghosts;
  ghosts->SetName(vtkDataSetAttributes::GhostArrayName());
  const vtkIdType count = of_cells ? set.GetNumberOfCells() : set.GetNumberOfPoints();
  for (vtkIdType i = 0; i < count; ++i)
    ghosts->InsertNextValue((of_cells ? i % 4 >= 2 : i % 5 >= 3) ? bit : static_cast<unsigned char>(0));
  data_of(set, of_cells).AddArray(ghosts);
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
  // A voxel on a face of a cell that is used is in it.
  const Row table[] = {{"hidden cells", true, vtkDataSetAttributes::HIDDENCELL, half},
                       {"refined cells", true, vtkDataSetAttributes::REFINEDCELL, half},
                       {"copies of cells", true, vtkDataSetAttributes::DUPLICATECELL, whole},
                       {"hidden points", false, vtkDataSetAttributes::HIDDENPOINT, half},
                       {"copies of points", false, vtkDataSetAttributes::DUPLICATEPOINT, whole}};
  for (const Row& row : table)
    for (const auto& [at_cells, values] :
         {std::pair(false, CellValues::linear), {true, CellValues::linear}, {true, CellValues::constant}})
      for (const auto& [ending, set] : kinds_of_cubes()) {
        add_ones(*set, "T", 9, at_cells);
        mark(*set, row.of_cells, row.bit);
        write_xml(*set, folder / ("a" + ending));
        EXPECT_EQ(voxels_of(folder / ("a" + ending), half_voxels("T", Take::tensor, values)), Counts(half, row.voxels))
            << row.name << ending << (at_cells ? " at cells" : " at points");
      }
}

TEST(Ghosts, DerivativesDoNotLookAtHiddenPointsOfAnyKindOfDataSet) {
  const TemporaryFolder folder;
  for (const auto& [ending, set] : kinds_of_cubes()) {
    add_array<3>(*set, "v",
                 [](const Vector3d& p) { return Vector3d(p.x() < 2.5 ? p.x() : 1e6, 2 * p.y(), 3 * p.z()); });
    mark(*set, false, vtkDataSetAttributes::HIDDENPOINT);
    write_xml(*set, folder / ("a" + ending));
    const Imported gradients = imported(folder / ("a" + ending), half_voxels("v", Take::gradient));
    EXPECT_LT((gradients.tensor() - Matrix3d(Vector3d(1, 2, 3).asDiagonal())).norm(), 1e-5) << ending;
    EXPECT_EQ(gradients.voxels(), half) << ending;
  }
}

/// Images whose voxels are kept do the same: of points, those that no used cell has are not there.
TEST(Ghosts, VoxelsThatAreKeptAreHiddenAsInAMesh) {
  const TemporaryFolder folder;
  for (const bool hides_cells : {true, false})
    for (const bool at_cells : {false, true}) {
      const auto image = vtkSmartPointer<vtkImageData>::New();
      image->SetDimensions(5, 3, 3);
      const unsigned char bits[] = {vtkDataSetAttributes::HIDDENPOINT, vtkDataSetAttributes::HIDDENCELL};
      mark(*image, hides_cells, bits[hides_cells]);
      add_ones(*image, "T", 9, at_cells);
      write_xml(*image, folder / "a.vti");
      EXPECT_EQ(imported(folder / "a.vti").voxels(), at_cells ? 2u * 2 * 2 : 3u * 3 * 3) << hides_cells;
    }
}

TEST(MissingData, OfPointsOfTwoPiecesTheFiniteValuesAreTakenWhateverTheirType) {
  const TemporaryFolder folder;
  const auto first = cubes(0, 2), second = cubes(2, 4);
  add_ones(*first, "T", 9, false, [](double) { return true; });
  add_ones(*second, "T", 9, false);
  const auto voxels = [&](vtkDataSet& one, vtkDataSet& other) {
    return imported(write_halves(folder, one, other), half_voxels("T")).voxels();
  };
  EXPECT_EQ(voxels(*first, *second), half);
  EXPECT_EQ(voxels(*second, *first), half);
  add_ones(*first, "T", 9, false);
  vtkNew<vtkIntArray> integers;
  integers->DeepCopy(first->GetPointData()->GetArray("T"));
  first->GetPointData()->AddArray(integers);
  EXPECT_EQ(voxels(*first, *second), whole);
  second->GetPointData()->RemoveArray("T");
  EXPECT_EQ(voxels(*first, *second), half);  // Not zeros.
}

TEST(MissingData, PiecesMayHaveComponentsInOtherOrders) {
  const TemporaryFolder folder;
  const auto first = cubes(0, 2), second = cubes(2, 4);
  const auto add = [](vtkDataSet& mesh, const std::array<const char*, 6>& names, const Vector6d& v) {
    add_array<6>(mesh, "S", [&](const Vector3d&) { return v; });
    for (int i = 0; i < 6; ++i) mesh.GetPointData()->GetArray("S")->SetComponentName(i, names[i]);
  };
  add(*first, {"s_xx", "s_xy", "s_xz", "s_yy", "s_yz", "s_zz"}, (Vector6d() << 1, 4, 6, 2, 5, 3).finished());
  add(*second, {"XX", "YY", "ZZ", "XY", "YZ", "XZ"}, (Vector6d() << 1, 2, 3, 4, 5, 6).finished());
  const Matrix3d expected = (Matrix3d() << 1, 4, 6, 4, 2, 5, 6, 5, 3).finished();
  const Matrix3d found = imported(write_halves(folder, *first, *second), half_voxels("S")).tensor();
  EXPECT_LT((found - expected).norm(), 1e-5);
}

}  // namespace
}  // namespace tensorray
