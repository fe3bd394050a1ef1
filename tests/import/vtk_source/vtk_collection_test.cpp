#include <fmt/format.h>
#include <vtkUnsignedCharArray.h>

#include "tests/import/imported.h"
#include "tests/import/sampling/sampled.h"
#include "tests/import/vtk_files.h"

namespace tensorray {
namespace {

using mesh_fixtures::for_each_voxel;
using Set = vtkSmartPointer<vtkDataSet>;

std::string collection(const std::string& type, const std::string& contents) {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"" + type + "\" version=\"1.0\">\n<" + type + ">\n" + contents +
         "</" + type + ">\n</VTKFile>\n";
}

std::string series(const std::string& contents) { return collection("Collection", contents); }

class VtkCollection : public testing::Test {
 protected:
  /// Expects that a file with this text is refused with these words.
  void refuses(const std::string& name, const std::string& text, const std::string& words) const {
    write_bytes(folder_ / name, text);
    EXPECT_THAT(read_error(folder_ / name), HasSubstr(words));
  }

  TemporaryFolder folder_;
};

TEST_F(VtkCollection, BlocksAtAnyDepthAreOneMeshWithoutSurfaces) {
  std::filesystem::create_directory(folder_ / "parts & more");
  write_xml(*bar(0, 3), folder_ / "parts & more" / "0.vtu");
  write_xml(*bar(3, 2), folder_ / "1.vtu");
  write_bytes(folder_ / "all.vtm", collection("vtkMultiBlockDataSet", R"(
    <DataSet index="0" file="parts &amp; more/0.vtu"/>
    <Block index="1"><Block index="0"><DataSet index="0" file="1.vtu"/><DataSet index="1" file="wall.vtp"/></Block>
    </Block><DataSet index="2"/>)"));
  const auto read = read_vtk_source(folder_ / "all.vtm");
  EXPECT_EQ(read->GetNumberOfCells(), 5);
  EXPECT_EQ(read->GetNumberOfPoints(), 24);  // The points of the seam are merged.
  EXPECT_FALSE(read->GetCellData()->HasArray(layer_array));
  for (vtkIdType i = 0; i < read->GetNumberOfPoints(); ++i)
    EXPECT_EQ(read->GetPointData()->GetArray("tensor")->GetComponent(i, 4), number(read->GetPoint(i), 4));
}

TEST_F(VtkCollection, OneImageStaysAnImage) {
  write_xml(*image(), folder_ / "a.vti");
  write_bytes(folder_ / "a.vtm", blocks_of({"a.vti"}));
  const auto read = read_vtk_source(folder_ / "a.vtm");
  EXPECT_TRUE(read->IsA("vtkImageData"));
  expect_same(*read, *image(), 0x1p-1000);
}

TEST_F(VtkCollection, OfATimeSeriesTheLastTimeWithAllItsParts) {
  write_xml(*bar(0, 1), folder_ / "early.vtu");
  write_xml(*bar(0, 3), folder_ / "late0.vtu");
  write_xml(*bar(3, 2), folder_ / "late1.vtu");
  write_bytes(folder_ / "late.vtm", blocks_of({"late0.vtu", "late1.vtu"}));
  write_bytes(folder_ / "parts.pvd", series(R"(<DataSet timestep="1e1" part="0" file="late0.vtu"/>
                                              <DataSet timestep="9" part="0" file="early.vtu"/>
                                              <DataSet timestep="10" part="1" file="late1.vtu"/>)"));
  write_bytes(folder_ / "blocks.pvd", series(R"(<DataSet timestep="-2" file="early.vtu"/>
                                               <DataSet timestep="-1" file="late.vtm"/>)"));
  for (const char* name : {"parts.pvd", "blocks.pvd"}) {
    EXPECT_EQ(time_steps(folder_ / name), 2) << name;
    for (const auto& [step, cells] : {std::pair(std::optional<int>(), 5), {0, 1}, {1, 5}})
      EXPECT_EQ(read_vtk_source(folder_ / name, step)->GetNumberOfCells(), cells) << name;
    EXPECT_THROW(read_vtk_source(folder_ / name, 2), std::invalid_argument) << name;
  }
}

TEST_F(VtkCollection, APartThatIsNamedTwiceForOneTimeCountsOnceOrIsRefused) {
  write_xml(*bar(0, 3), folder_ / "a.vtu");
  const auto other = bar(0, 3);
  other->GetPointData()->GetArray("tensor")->Fill(7);
  write_xml(*other, folder_ / "restarted.vtu");
  const std::string a = "<DataSet timestep=\"1\" part=\"0\" file=\"a.vtu\"/>\n";
  for (const std::string& again : {a, replaced_text(a, "a.vtu", "./a.vtu")}) {
    write_bytes(folder_ / "same.pvd", series(a + again));
    expect_same(*read_vtk_source(folder_ / "same.pvd"), *bar(0, 3), 0x1p-1000);
  }
  for (const char* part : {"part=\"0\" ", ""})
    refuses("both.pvd", series(a + "<DataSet timestep=\"1\" " + part + "file=\"restarted.vtu\"/>\n"),
            "both.pvd: names the same mesh twice for one time, as a.vtu and as restarted.vtu");
  refuses("both.vtm", blocks_of({"a.vtu", "restarted.vtu"}), "names the same mesh twice");
}

TEST_F(VtkCollection, OfASeriesOfFilesEachIsAStep) {
  const auto file_series = [](const std::string& files) {
    return "{\n  \"file-series-version\" : \"1.0\",\n  \"files\" : [" + files + "]\n}\n";
  };
  for (int i = 1; i <= 3; ++i) write_xml(*bar(0, i), folder_ / (std::to_string(i) + ".vtu"));
  const std::filesystem::path file = folder_ / "a.vtu.series";
  write_bytes(file, file_series(R"({"name": "3.vtu", "time": 1.5}, {"name": "1.vtu", "time": -1},
                                   {"name": "./2.vtu", "time": 1})"));
  EXPECT_EQ(time_steps(file), 3);
  for (const int step : {0, 1, 2}) EXPECT_EQ(read_vtk_source(file, step)->GetNumberOfCells(), step + 1);
  EXPECT_EQ(read_vtk_source(file)->GetNumberOfCells(), 3);
  for (const char* none : {"", R"({"time": 1})"}) refuses("a.vtu.series", file_series(none), "names no files");
  refuses("a.vtu.series", file_series(R"({"name": "4.vtu"})"), "4.vtu: does not exist");
  refuses("a.vtu.series", file_series(R"({"name": "a.vtu.series"})"), "names the collection");
  refuses("a.vtu.series", "[1, 2", "is not a series of files");
}

TEST_F(VtkCollection, ErrorsNameTheFile) {
  write_xml(*bar(0, 1), folder_ / "a.vtu");
  refuses("a.vtm", blocks_of({"none.vtu"}), "none.vtu: does not exist");
  refuses("a.vtm", blocks_of({"wall.vtp"}), "a.vtm: names no file of a volume");
  refuses("a.vtm", blocks_of({"a.vtm"}), "a.vtm: names the collection");
  refuses("a.pvd", series("<DataSet timestep=\"0\" file=\"a.pvd\"/>"), "a.pvd: names the collection");
  refuses("a.pvd", series("<DataSet timestep=\"late\" file=\"a.vtu\"/>"), "a.pvd: its time 'late' is not a number");
  refuses(
      "a.pvd", blocks_of({"a.vtu"}),
      "a.pvd: its ending says a ParaView collection, its contents are a VTK multi-block file; give it the ending .vtm");
  refuses("a.pvd", series("<DataSet file=\"a.vtu\"/>").substr(0, 80), "a.pvd: is cut off");
  refuses("a.pvd", "<VTKFile type=\"Collection\"><Collection></VTKFile>", "a.pvd: ");
  refuses("a.xdmf", "<Xdmf></Xdmf>", "a.xdmf: has no grid");
}

// Blocks that overlap, and copies of other pieces' cells and points: what counts at a voxel.
/// Adds the array "T", of points or cells, of multiples of the identity.
void add_values(vtkDataSet& set, bool of_cells, double value) {
  const auto tensor = [&](const auto&) { return mesh_fixtures::flat(value * Matrix3d::Identity()); };
  of_cells ? mesh_fixtures::add_cell_array<9>(set, "T", tensor) : mesh_fixtures::add_array<9>(set, "T", tensor);
}

/// A cube of n³ cells: an image, or a structured or unstructured grid.
Set cube(const std::string& ending, double first, double edge, int n) {
  const auto at = [=](const Vector3d& p) { return Vector3d((Vector3d::Constant(first) + n * edge * p)); };
  if (ending == ".vts") return mesh_fixtures::curvilinear(Eigen::Vector3i::Constant(n + 1), at);
  if (ending == ".vtu") return mesh_fixtures::unit_cube(VTK_TETRA, n, at);
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(n + 1, n + 1, n + 1);
  image->SetOrigin(first, first, first);
  image->SetSpacing(edge, edge, edge);
  return image;
}

TEST(OverlappingBlocks, TheFinerCellCountsInAnyOrder) {
  const TemporaryFolder folder;
  for (const std::string ending : {".vti", ".vts", ".vtu"})
    for (const bool of_cells : {false, true}) {
      const Set coarse = cube(ending, 0, 1, 4), fine = cube(ending, 1, 0.5, 4);
      add_values(*coarse, of_cells, 1);
      add_values(*fine, of_cells, 2);
      write_xml(*coarse, folder / ("a" + ending));
      write_xml(*fine, folder / ("b" + ending));
      for (const auto& [first, second] : {std::pair("a", "b"), {"b", "a"}})
        for (const double voxel : {0.3, 0.5, 1.0}) {  // Of 1, values are averages over thinner cells.
          write_bytes(folder / "both.vtm", blocks_of({first + ending, second + ending}));
          const Imported both = imported(folder / "both.vtm", array_settings("T", Take::tensor, voxel));
          const AlignedBox3d fine_box(Vector3d::Constant(1 - 1e-5), Vector3d::Constant(3 + 1e-5));
          std::size_t inside = 0;
          for_each_voxel(both.grid, [&](const Vector3d& x, const Matrix3d& tensor) {
            const bool is_fine = fine_box.contains(x);
            inside += is_fine;
            EXPECT_LT((tensor - (is_fine ? 2 : 1) * Matrix3d::Identity()).norm(), 1e-5)
                << ending << of_cells << first << voxel << " " << x.transpose();
          });
          EXPECT_EQ(both.report.mesh->overlaid, inside) << ending << voxel;
        }
    }
}

/// Marks the last cell, or the points of the last face, as copies with a value that is not right any more.
void add_stale(vtkUnstructuredGrid& set, bool of_cells) {
  vtkNew<vtkUnsignedCharArray> marks;
  marks->SetName(vtkDataSetAttributes::GhostArrayName());
  const vtkIdType count = of_cells ? set.GetNumberOfCells() : set.GetNumberOfPoints(), stale = of_cells ? 1 : 4;
  vtkDataSetAttributes& data = *set.GetAttributes(of_cells ? vtkDataObject::CELL : vtkDataObject::POINT);
  for (vtkIdType i = 0; i < count; ++i) {
    marks->InsertNextValue(i < count - stale ? 0 : 1);  // DUPLICATECELL and DUPLICATEPOINT.
    for (const int diagonal : {0, 4, 8})
      if (i >= count - stale) data.GetArray("T")->SetComponent(i, diagonal, 7);
  }
  data.AddArray(marks);
}

TEST(OverlappingBlocks, CopiesNeverCountWhereTheirOriginIs) {
  const TemporaryFolder folder;
  for (const bool of_cells : {true, false}) {
    const auto first = bar(0, 3), second = bar(of_cells ? 2 : 3, 2);
    for (vtkDataSet* const set : {first.Get(), second.Get()}) add_values(*set, of_cells, 1);
    add_stale(*first, of_cells);
    write_xml(*first, folder / "a.vtu");
    write_xml(*second, folder / "b.vtu");
    write_bytes(folder / "all.vtm", blocks_of({"a.vtu", "b.vtu"}));
    const auto merged = bar(0, 3);  // One file that has a copy and its origin.
    vtkNew<vtkIdList> corners;
    merged->GetCellPoints(1, corners);
    merged->InsertNextCell(VTK_HEXAHEDRON, corners);
    merged->GetCellData()->Initialize();
    add_values(*merged, true, 1);
    add_stale(*merged, true);
    write_xml(*merged, folder / "merged.vtu");
    for (const char* const name : {"all.vtm", "merged.vtu"}) {
      const Imported found = imported(folder / name, array_settings("T", Take::tensor, 0.25));
      EXPECT_LT((found.tensor(1e-6) - Matrix3d::Identity()).norm(), 1e-6) << name << of_cells;
      EXPECT_EQ(found.report.mesh->overlaid, 0u);
    }
  }
}

TEST(OverlappingBlocks, LevelsOfAdaptiveRefinementArriveAsLevels) {
  const TemporaryFolder folder;
  // Blocks as adaptive codes write them: each halves the cells of the one before within a part of it.
  std::filesystem::create_directory(folder / "levels");
  const double begins[] = {0, 8, 12}, edges[] = {1, 0.5, 0.25};
  std::string blocks[3];
  for (int level = 0; level < 3; ++level) {
    const Set block = cube(".vti", begins[level], edges[level], level == 0 ? 32 : 16);
    add_values(*block, true, level + 1);
    write_xml(*block, folder / fmt::format("levels/{}.vti", level));
    blocks[level] = fmt::format(
        R"(<Block level="{0}" index="{0}"><DataSet index="0" amr_box="0 7 0 7 0 7" file="levels/{0}.vti"/></Block>)",
        level);
  }
  const auto box_of = [&](int level, double margin) {
    return AlignedBox3d(Vector3d::Constant(begins[level] - margin),
                        Vector3d::Constant(begins[level] + 16 * edges[level] + margin));
  };
  for (const auto& [name, type] : {std::pair("all.vth", "vtkOverlappingAMR"), {"all.vtm", "vtkMultiBlockDataSet"}})
    for (const int levels : {2, 3}) {
      SCOPED_TRACE(name + std::to_string(levels));
      write_bytes(folder / name, collection(type, blocks[0] + blocks[1] + (levels == 3 ? blocks[2] : "")));
      const auto [grid, report] = imported(folder / name);
      EXPECT_NEAR(report.mesh->voxel.x(), 1, 1e-9);
      ASSERT_EQ(grid.finer.size(), static_cast<std::size_t>(levels - 1));
      for (int level = 1; level < levels; ++level) {
        const AlignedBox3d finer = level + 1 == levels ? AlignedBox3d() : box_of(level + 1, 0.6 * edges[level]);
        std::size_t inside = 0;
        for_each_voxel(mesh_fixtures::level_of(grid, level), [&](const Vector3d& x, const Matrix3d& tensor) {
          if (!box_of(level, 0).contains(x) || finer.contains(x)) return;
          ++inside;
          EXPECT_LT((tensor - (level + 1) * Matrix3d::Identity()).norm(), 1e-5) << x.transpose();
        });
        EXPECT_GT(inside, 2000u);
      }
    }
}

}  // namespace
}  // namespace tensorray
