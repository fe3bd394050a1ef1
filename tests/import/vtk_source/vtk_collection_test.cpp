// Blocks (.vtm) and time series (.pvd).

#include <string>

#include "tests/import/mesh_files.h"
#include "tests/import/vtk_files.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {
namespace {

std::string collection(const std::string& type, const std::string& contents) {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"" + type + "\" version=\"1.0\">\n<" + type + ">\n" + contents +
         "</" + type + ">\n</VTKFile>\n";
}

std::string blocks(const std::string& contents) { return collection("vtkMultiBlockDataSet", contents); }
std::string series(const std::string& contents) { return collection("Collection", contents); }

TEST(VtkCollection, BlocksAtAnyDepthAreOneMeshWithoutSurfaces) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "parts & more");
  write_xml(*bar(0, 3), folder / "parts & more" / "0.vtu");
  write_xml(*bar(3, 2), folder / "1.vtu");
  write_bytes(folder / "all.vtm",
              blocks("<DataSet index=\"0\" file=\"parts &amp; more/0.vtu\"/>\n<Block index=\"1\"><Block index=\"0\">"
                     "<DataSet index=\"0\" file=\"1.vtu\"/><DataSet index=\"1\" file=\"wall.vtp\"/></Block></Block>\n"
                     "<DataSet index=\"2\"/>\n"));
  const auto read = read_vtk_source(folder / "all.vtm");
  EXPECT_EQ(read->GetNumberOfCells(), 5);
  EXPECT_EQ(read->GetNumberOfPoints(), 24);  // The points of the seam are merged.
  for (vtkIdType i = 0; i < read->GetNumberOfPoints(); ++i)
    EXPECT_EQ(read->GetPointData()->GetArray("tensor")->GetComponent(i, 4), number(read->GetPoint(i), 4));
}

TEST(VtkCollection, OneImageStaysAnImage) {
  const TemporaryFolder folder;
  write_xml(*image(), folder / "a.vti");
  write_bytes(folder / "a.vtm", blocks("<DataSet index=\"0\" file=\"a.vti\"/>"));
  const auto read = read_vtk_source(folder / "a.vtm");
  EXPECT_TRUE(read->IsA("vtkImageData"));
  expect_same(*read, *image(), 0x1p-1000);
}

TEST(VtkCollection, OfATimeSeriesTheLastTimeWithAllItsParts) {
  const TemporaryFolder folder;
  write_xml(*bar(0, 1), folder / "early.vtu");
  write_xml(*bar(0, 3), folder / "late0.vtu");
  write_xml(*bar(3, 2), folder / "late1.vtu");
  write_bytes(folder / "late.vtm", blocks("<DataSet file=\"late0.vtu\"/><DataSet file=\"late1.vtu\"/>"));
  write_bytes(folder / "parts.pvd", series("<DataSet timestep=\"1e1\" part=\"0\" file=\"late0.vtu\"/>\n"
                                           "<DataSet timestep=\"9\" part=\"0\" file=\"early.vtu\"/>\n"
                                           "<DataSet timestep=\"10\" part=\"1\" file=\"late1.vtu\"/>\n"));
  EXPECT_EQ(read_vtk_source(folder / "parts.pvd")->GetNumberOfCells(), 5);
  EXPECT_EQ(time_steps(folder / "parts.pvd"), 2);
  EXPECT_EQ(read_vtk_source(folder / "parts.pvd", 0)->GetNumberOfCells(), 1);
  EXPECT_EQ(read_vtk_source(folder / "parts.pvd", 1)->GetNumberOfCells(), 5);
  EXPECT_THROW(read_vtk_source(folder / "parts.pvd", 2), std::invalid_argument);
  write_bytes(folder / "blocks.pvd", series("<DataSet timestep=\"-2\" file=\"early.vtu\"/>\n"
                                            "<DataSet timestep=\"-1\" file=\"late.vtm\"/>\n"));
  EXPECT_EQ(read_vtk_source(folder / "blocks.pvd")->GetNumberOfCells(), 5);
}

TEST(VtkCollection, APartThatIsNamedTwiceForOneTimeCountsOnceOrIsRefused) {
  const TemporaryFolder folder;
  write_xml(*bar(0, 3), folder / "a.vtu");
  const auto other = bar(0, 3);
  other->GetPointData()->GetArray("tensor")->Fill(7);
  write_xml(*other, folder / "restarted.vtu");
  const std::string a = "<DataSet timestep=\"1\" part=\"0\" file=\"a.vtu\"/>\n";
  write_bytes(folder / "same.pvd", series(a + a));
  expect_same(*read_vtk_source(folder / "same.pvd"), *bar(0, 3), 0x1p-1000);
  write_bytes(folder / "same.pvd", series(a + "<DataSet timestep=\"1\" part=\"0\" file=\"./a.vtu\"/>\n"));
  expect_same(*read_vtk_source(folder / "same.pvd"), *bar(0, 3), 0x1p-1000);
  for (const char* part : {"part=\"0\" ", ""}) {
    write_bytes(folder / "both.pvd", series(a + "<DataSet timestep=\"1\" " + part + "file=\"restarted.vtu\"/>\n"));
    const std::string error = read_error(folder / "both.pvd");
    EXPECT_NE(error.find("both.pvd: names the same mesh twice for one time, as a.vtu and as restarted.vtu"),
              std::string::npos)
        << error;
  }
  write_bytes(folder / "both.vtm", blocks("<DataSet file=\"a.vtu\"/><DataSet file=\"restarted.vtu\"/>"));
  EXPECT_NE(read_error(folder / "both.vtm").find("names the same mesh twice"), std::string::npos);
}

TEST(VtkCollection, OfASeriesOfFilesEachIsAStep) {
  const TemporaryFolder folder;
  const auto file_series = [](const std::string& files) {
    return "{\n  \"file-series-version\" : \"1.0\",\n  \"files\" : [" + files + "]\n}\n";
  };
  for (int i = 1; i <= 3; ++i) write_xml(*bar(0, i), folder / (std::to_string(i) + ".vtu"));
  write_bytes(folder / "a.vtu.series",
              file_series("{\"name\": \"3.vtu\", \"time\": 1.5}, {\"name\": \"1.vtu\", \"time\": "
                          "-1}, {\"name\": \"./2.vtu\", \"time\": 1}"));
  EXPECT_EQ(time_steps(folder / "a.vtu.series"), 3);
  for (const int step : {0, 1, 2})
    EXPECT_EQ(read_vtk_source(folder / "a.vtu.series", step)->GetNumberOfCells(), step + 1);
  EXPECT_EQ(read_vtk_source(folder / "a.vtu.series")->GetNumberOfCells(), 3);
  for (const auto& [text, error] : {std::pair(file_series(""), "names no files"),
                                    {file_series("{\"time\": 1}"), "names no files"},
                                    {file_series("{\"name\": \"4.vtu\"}"), "4.vtu: does not exist"},
                                    {file_series("{\"name\": \"a.vtu.series\"}"), "names the collection"},
                                    {std::string("[1, 2"), "is not a series of files"}}) {
    write_bytes(folder / "a.vtu.series", text);
    EXPECT_NE(read_error(folder / "a.vtu.series").find(error), std::string::npos)
        << read_error(folder / "a.vtu.series");
  }
}

TEST(VtkCollection, ErrorsNameTheFile) {
  const TemporaryFolder folder;
  write_xml(*bar(0, 1), folder / "a.vtu");
  const auto refuses = [&](const char* name, const std::string& text, const std::string& file, const char* part) {
    write_bytes(folder / name, text);
    const std::string error = read_error(folder / name);
    EXPECT_NE(error.find(file), std::string::npos) << error;
    EXPECT_NE(error.find(part), std::string::npos) << error;
  };
  refuses("a.vtm", blocks("<DataSet file=\"none.vtu\"/>"), "none.vtu", "does not exist");
  refuses("a.vtm", blocks("<DataSet file=\"wall.vtp\"/>"), "a.vtm", "names no file of a volume");
  refuses("a.vtm", blocks("<DataSet file=\"a.vtm\"/>"), "a.vtm", "names the collection");
  refuses("a.pvd", series("<DataSet timestep=\"0\" file=\"a.pvd\"/>"), "a.pvd", "names the collection");
  refuses("a.pvd", series("<DataSet timestep=\"late\" file=\"a.vtu\"/>"), "a.pvd", "'late' is not a number");
  refuses("a.pvd", blocks("<DataSet file=\"a.vtu\"/>"), "a.pvd", "give it the ending .vtm");
  refuses("a.pvd", series("<DataSet file=\"a.vtu\"/>").substr(0, 80), "a.pvd", "cut off");
  refuses("a.pvd", "<VTKFile type=\"Collection\"><Collection></VTKFile>", "a.pvd", "a.pvd");
  refuses("a.xdmf", "<Xdmf></Xdmf>", "a.xdmf", "has no grid");
}

}  // namespace
}  // namespace tensorray
