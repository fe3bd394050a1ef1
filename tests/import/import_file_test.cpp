#include "tools/import/import_file.h"

#include <functional>

#include <vtkDoubleArray.h>

#include "tests/import/hdf5_writer.h"
#include "tests/import/imported.h"
#include "tests/import/openfoam_case.h"
#include "tests/import/vtk_files.h"

namespace tensorray {
namespace {

using mesh_fixtures::add_array, mesh_fixtures::add_cell_array;

/// VTK complains of each cell that it cannot invert, on every thread.
TEST(ImportFileTest, FlatCellsAreTakenInSilence) {
  const TemporaryFolder folder;
  const auto mesh = bar(0, 3);
  for (int i = 8; i < 12; ++i) mesh->GetPoints()->SetPoint(i, 1, i % 2, (i - 8) / 2);  // As those before them.
  add_array<3>(*mesh, "velocity", [](const Vector3d& p) { return Vector3d(p.x() + p.y(), 2, 3); });
  write_xml(*mesh, folder / "a.vtu");
  testing::internal::CaptureStderr();
  ImportSettings settings = array_settings("velocity", Take::gradient);
  settings.sampling.resolution = 5;
  error_of([&] { imported(folder / "a.vtu", settings); });
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

/// Its values are at points or at cells; arrays of more than one number do not count.
TEST(ImportFileTest, AnImageOfVtkMayBeAMask) {
  const TemporaryFolder folder;
  write_xml(*image(), folder / "a.vti");
  write_xml(*bar(0, 3), folder / "bar.vtu");
  const auto mask = [&](const char* file, bool of_cells, int arrays, int part) {
    const auto set = image();
    if (of_cells)
      set->SetDimensions(6, 5, 4), set->SetOrigin(0.75, 1.5, 2);  // Its cells are about the points of a.vti.
    set->GetPointData()->Initialize();
    if (of_cells) set->GetCellData()->Initialize();
    for (int array = 0; array < arrays; ++array) {
      vtkNew<vtkDoubleArray> values;
      values->SetName(array == 0 ? "brain" : "other");
      for (int i = 0; i < 60; ++i) values->InsertNextValue(i % 5 < part ? 1 : i % 2 == 0 ? 0 : NAN);
      (of_cells ? vtkDataSetAttributes::SafeDownCast(set->GetCellData()) : set->GetPointData())->AddArray(values);
    }
    write_xml(*set, folder / file);
  };
  mask("points.vti", false, 1, 2);
  mask("cells.vti", true, 1, 3);
  mask("none.vti", false, 0, 1);
  mask("several.vti", true, 2, 1);
  ImportSettings settings;
  const auto active = [&](const char* file) {
    settings.mask = folder / file;
    return imported(folder / "a.vti", settings).voxels();
  };
  EXPECT_EQ(active("points.vti"), 24u);
  EXPECT_EQ(active("cells.vti"), 36u);
  for (const auto& [file, text] : {std::pair("none.vti", "rate (3 components"),
                                   {"several.vti", "other (1 component"},
                                   {"bar.vtu", "a mask has voxels"}})
    EXPECT_THAT(([&active, file = file] { active(file); }),
                testing::ThrowsMessage<std::invalid_argument>(HasSubstr(text)));
}

/// Two steps, of which the second one was announced and not written: the first one is taken, which is said.
TEST(ImportFileTest, TheLastCompleteStepIsTaken) {
  const TemporaryFolder folder;
  const auto xdmf = [&](const char* second) {
    std::string grids;
    { Hdf5Writer(folder / "a.h5").write("/first", {8, 9}, std::vector<double>(72, 5)); }
    for (const std::string place : {"a.h5:/first", second})
      grids +=
          "<Grid><Topology TopologyType=\"3DCoRectMesh\" Dimensions=\"2 2 2\"/><Geometry "
          "GeometryType=\"ORIGIN_DXDYDZ\"><DataItem Dimensions=\"3\" Format=\"XML\">0 0 0</DataItem><DataItem "
          "Dimensions=\"3\" Format=\"XML\">1 1 1</DataItem></Geometry><Attribute Name=\"T\" Center=\"Node\"><DataItem "
          "Dimensions=\"8 9\" Format=\"HDF\">" +
          place + "</DataItem></Attribute></Grid>";
    write_bytes(folder / "a.xdmf", "<Xdmf><Domain><Grid GridType=\"Collection\" CollectionType=\"Temporal\">" + grids +
                                       "</Grid></Domain></Xdmf>");
    return folder / "a.xdmf";
  };
  const auto pvd = [&](const std::string& second) {
    write_xml(*bar(0, 1), folder / "first.vtu");
    write_bytes(folder / "second.vtu", second);
    if (second.empty()) std::filesystem::remove(folder / "second.vtu");
    write_bytes(folder / "a.pvd",
                "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0\" file=\"first.vtu\"/><DataSet "
                "timestep=\"1\" file=\"second.vtu\"/></Collection></VTKFile>\n");
    return folder / "a.pvd";
  };
  const auto openfoam = [&] {
    OpenFoamCase::write(folder / "case");
    const std::filesystem::path field = folder / "case" / "0.5" / "gradU";
    std::filesystem::resize_file(field, file_size(field) / 2);
    return folder / "case";
  };
  struct Row {
    std::function<std::filesystem::path()> make;
    const char *array, *words;
  };
  const Row table[] = {{[&] { return xdmf("a.h5:/second"); }, "T", "has no dataset /second"},
                       {[&] { return xdmf("b.h5:/second"); }, "T", "b.h5: is missing"},
                       {[&] { return pvd(""); }, "tensor", "second.vtu: does not exist"},
                       {[&] { return pvd("<VTKFile type=\"UnstructuredGrid\">"); }, "tensor", "second.vtu: is cut off"},
                       {[&] { return openfoam(); }, "gradU", ""}};
  for (const Row& row : table) {
    ImportSettings settings = array_settings(row.array);
    settings.files = {row.make()};
    const Imported found = imported(settings);
    EXPECT_LT(found.grid.blocks[0].values[0].norm(), 900) << row.words;
    EXPECT_THAT(found.notes(), AllOf(HasSubstr("step 1 of 2 is taken"), HasSubstr(row.words)));
    settings.step = 1;
    EXPECT_ANY_THROW(imported(settings)) << row.words;
  }
  // A field may be missing where none was wanted, so that no other step is taken.
  std::filesystem::remove(openfoam() / "0.5" / "gradU");
  EXPECT_THAT([&] { imported(folder / "case", array_settings("gradU")); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("(step 2 of 2 is taken; --steps chooses")));
}

TEST(ImportFileTest, GuessesAndTensorsThatAreHardlyMeantAreSaid) {
  const TemporaryFolder folder;
  struct Row {
    const char* name;
    std::function<double(int tuple, int component)> value;
    const char* warning;  ///< Empty: none.
  };
  const auto usual = [](int tuple, int component) { return 1.0 + tuple + component; };
  const auto mixed = [&](double value) {
    return [=](int tuple, int component) { return tuple % 4 == 1 ? value : usual(tuple, component); };
  };
  const Row table[] = {{"usual", usual, ""},
                       {"zero", [](int, int) { return 0.0; }, "all tensors are zero"},
                       {"same", [](int, int component) { return 1.0 + component; }, "all tensors are the same"},
                       {"1e20", mixed(1e20), "values are as 1e+20"},
                       {"1e30", mixed(-1e30), "values are as -1e+30"},
                       {"netCDF", mixed(9.969209968386869e36), "values are as 9.96921e+36"},
                       {"-999", mixed(-999), "values are as -999,"},
                       {"-9999", mixed(-9999), "values are as -9999,"},
                       {"a component of -999", [&](int t, int c) { return c == 3 ? -999 : usual(t, c); }, ""},
                       {"NaN", [](int, int) { return NAN; }, "NaN"}};
  for (const auto& [ending, set] : data_sets())
    for (const Row& row : table) {
      vtkDataArray& array = *set->GetPointData()->GetArray("tensor");
      for (int i = 0; i < array.GetNumberOfTuples(); ++i)
        for (int k = 0; k < 9; ++k) array.SetComponent(i, k, row.value(i, k));
      write_xml(*set, folder / ("a" + ending));
      std::string said;
      try {
        said = imported(folder / ("a" + ending), array_settings("tensor")).warnings();
      } catch (const std::exception& error) {
        said = error.what();
      }
      EXPECT_THAT(said, HasSubstr(row.warning)) << row.name << ending;
      EXPECT_EQ(said.empty(), row.warning[0] == '\0') << row.name << ending << said;
    }
  const auto set = bar(0, 3);
  add_cell_array<12>(*set, "tensor", [](vtkIdType) { return Eigen::Matrix<double, 12, 1>::Ones(); });
  write_xml(*set, folder / "a.vtu");
  ImportSettings settings;
  EXPECT_THAT(imported(folder / "a.vtu", settings).notes(),
              HasSubstr("\"tensor\" is at points and at cells: that at points is taken"));
  settings.cell_values = CellValues::constant;
  settings.order = TensorOrder::vtk;
  EXPECT_THAT(imported(folder / "a.vtu", settings).notes(),
              AllOf(HasSubstr("that at cells is taken"), HasSubstr("12 components: the first six")));
}

}  // namespace
}  // namespace tensorray
