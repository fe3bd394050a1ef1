// Files that VTK would read wrongly, or that would crash it, are errors before or after VTK reads them.

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <vtkXMLPolyDataWriter.h>

#include "tests/import/mesh_files.h"
#include "tests/import/vtk_files.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {
namespace {

TEST(VtkDamageTest, FilesThatAreNotWhatTheirEndingSays) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& name) { return error_of([&] { read_vtk_source(folder / name); }); };
  write_xml(*structured(), folder / "grid.vts");
  for (const char* name : {"a.vtk", "a.vti", "a.vtr", "a.vtu", "a.pvti", "a.pvtu", "a.ex2", "a.e", "a.foam"}) {
    std::filesystem::copy_file(folder / "grid.vts", folder / name);
    const std::string text = error(name);
    EXPECT_NE(text.find(std::string(name) + ": its ending says "), std::string::npos) << name << text;
    EXPECT_NE(text.find("a VTK structured grid; give it the ending .vts"), std::string::npos) << text;
  }
  std::filesystem::copy_file(folder / "grid.vts", folder / "grid.xml");
  write_bytes(folder / "unknown.abc", "of no kind");
  for (const char* supported : {"ExodusII", ".nrrd", ".nii", ".npy", "PLOT3D needs two files, the grid and its q"})
    EXPECT_NE(error("unknown.abc").find(supported), std::string::npos) << error("unknown.abc");
  EXPECT_EQ(read_vtk_source(folder / "grid.xml")->GetNumberOfPoints(), 24);
  for (const char* name : {"b.vtk", "b.vti", "b.vts", "b.pvtu", "b.ex2", "b.abc"}) {
    write_bytes(folder / name, std::string(5000, 'x') + '\x01');
    EXPECT_NE(error(name).find(std::string(name) + ": is n"), std::string::npos) << error(name);
    write_bytes(folder / name, "");
    EXPECT_NE(error(name).find("is empty"), std::string::npos) << error(name);
    EXPECT_NE(error(std::string("c") + name).find("does not exist"), std::string::npos);
  }
  write_bytes(folder / "surface.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 0 float\n");
  EXPECT_NE(error("surface.vtk").find("surfaces"), std::string::npos);
  write_bytes(folder / "surface.vtp", "<VTKFile type=\"PolyData\"></VTKFile>");
  EXPECT_NE(error("surface.vtp").find("'PolyData'"), std::string::npos);
}

TEST(VtkDamageTest, TypesAreQuotedOnOneLine) {
  const TemporaryFolder folder;
  write_bytes(folder / "a.vtu", "<VTKFile type=\"Poly\nData\x1b\"></VTKFile>");
  EXPECT_NE(error_of([&] { read_vtk_source(folder / "a.vtu"); }).find("'Poly\\nData\\x1b'"), std::string::npos);
}

/// netCDF fails on this header, and also prints messages about it.
TEST(VtkDamageTest, NothingButTheErrorIsSaid) {
  const std::filesystem::path data = data_file("disk_out_ref/disk_out_ref.ex2");
  SKIP_WITHOUT(data);
#ifdef TENSORRAY_SANITIZED
  GTEST_SKIP() << "the sanitizer's report is not to be lost, so that nothing is silenced";
#endif
  const TemporaryFolder folder;
  using Change = std::pair<std::size_t, int>;
  for (const std::vector<Change>& changes : std::vector<std::vector<Change>>{
           {{4201, 185}, {1214, 174}, {2258, 47}}, {{2049, 233}, {5332, 215}, {1192, 28}}, {{5993, 67}, {873, 86}}}) {
    std::string bytes = bytes_of(data);
    for (const auto& [at, value] : changes) bytes[at] = static_cast<char>(value);
    write_bytes(folder / "a.ex2", bytes);
    testing::internal::CaptureStderr();
    const std::string error = error_of([&] { read_vtk_source(folder / "a.ex2"); });
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_NE(error, "");
  }
}

std::string tetrahedron(const std::string& points, const std::string& cells, const std::string& type = "10") {
  return "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n" + points + "\nCELLS 1 " +
         cells + "\nCELL_TYPES 1\n" + type + "\nPOINT_DATA 4\nSCALARS s double\nLOOKUP_TABLE default\n1 2 3 4\n";
}

TEST(VtkDamageTest, CellsOfPointsThatAreNotThere) {
  const TemporaryFolder folder;
  const std::string points = "0 0 0 1 0 0 0 1 0 0 0 1";
  const auto error = [&](const std::string& cells, const std::string& type) {
    write_bytes(folder / "a.vtk", tetrahedron(points, cells, type));
    return error_of([&] { read_vtk_source(folder / "a.vtk"); });
  };
  EXPECT_EQ(error("5\n4 0 1 2 3", "10"), "");
  for (const char* id : {"4", "50", "3000000", "-1"}) {
    const std::string text = error(std::string("5\n4 0 1 2 ") + id, "10");
    EXPECT_NE(text.find("a.vtk: "), std::string::npos) << id;
    EXPECT_NE(text.find(std::string("a cell has point ") + id + " of 4"), std::string::npos) << text;
  }
  EXPECT_NE(error("4\n3 0 1 2", "10").find("cell 0 has fewer points"), std::string::npos);

  const std::string faces = "4 3 0 1 2 3 0 3 1 3 1 3 2 3 0 2 ";  // the faces of a polyhedron
  EXPECT_EQ(error("18\n17 " + faces + "3", "42"), "");
  EXPECT_NE(error("18\n17 " + faces + "9", "42").find("a.vtk: "), std::string::npos);
}

/// Faces with other points than their cell has. Only XML files can contain such faces.
TEST(VtkDamageTest, FacesOfPointsThatAreNotThere) {
  const TemporaryFolder folder;
  const auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  vtkNew<vtkPoints> points;
  for (int i = 0; i < 4; ++i) points->InsertNextPoint(i == 1, i == 2, i == 3);
  grid->SetPoints(points);
  const vtkIdType corners[] = {0, 1, 2, 3}, faces[] = {3, 0, 1, 2, 3, 0, 3, 1, 3, 1, 3, 2, 3, 0, 2, 3};
  grid->InsertNextCell(VTK_POLYHEDRON, 4, corners, 4, faces);
  write_xml(*grid, folder / "a.vtu", Mode::ascii);
  EXPECT_EQ(read_vtk_source(folder / "a.vtu")->GetNumberOfCells(), 1);
  const std::string bytes = bytes_of(folder / "a.vtu");
  const std::size_t stream = bytes.find("4 3 0 1 2 3\n");
  ASSERT_NE(stream, std::string::npos) << bytes;
  // Wrong counts in the stream are not tested: there VTK itself reads beyond the end.
  std::string damaged = bytes;
  damaged[stream + 8] = '9';
  write_bytes(folder / "a.vtu", damaged);
  EXPECT_NE(error_of([&] { read_vtk_source(folder / "a.vtu"); }).find("a.vtu: "), std::string::npos);
}

TEST(VtkDamageTest, CoordinatesThatAreNotFiniteOrTooLarge) {
  const TemporaryFolder folder;
  for (const double wrong : {std::nan(""), HUGE_VAL, -1e31}) {
    const auto refuses = [&](vtkDataSet& set, const char* name, const char* place) {
      write_xml(set, folder / name);
      const std::string error = error_of([&] { read_vtk_source(folder / name); });
      EXPECT_NE(error.find(std::string(name) + ": "), std::string::npos) << wrong;
      EXPECT_NE(error.find(place), std::string::npos) << error;
      EXPECT_NE(error.find("not finite, or beyond 1e30"), std::string::npos) << error;
    };
    const auto cubes = bar(0, 2);
    cubes->GetPoints()->SetPoint(5, 1, wrong, 0);
    refuses(*cubes, "a.vtu", "point 5 ");
    const auto curved = structured();
    curved->GetPoints()->SetPoint(7, 0, 0, wrong);
    refuses(*curved, "a.vts", "point 7 ");
    const auto straight = rectilinear();
    straight->GetYCoordinates()->SetComponent(1, 0, wrong);
    refuses(*straight, "a.vtr", "y coordinate 1 ");
    const auto moved = image(), stretched = image();
    moved->SetOrigin(0, wrong, 0);
    stretched->SetSpacing(1, 1, wrong);
    refuses(*moved, "a.vti", "origin");
    refuses(*stretched, "b.vti", "spacing");
  }
  write_bytes(folder / "a.vtk", tetrahedron("0 0 0 1e29 0 0 0 1 0 0 0 -1e29", "5\n4 0 1 2 3"));
  EXPECT_EQ(read_vtk_source(folder / "a.vtk")->GetNumberOfPoints(), 4);
  write_bytes(folder / "a.vtk", tetrahedron("0 0 0 1 0 0 0 1 0 0 0 nan", "5\n4 0 1 2 3"));
  EXPECT_NE(error_of([&] { read_vtk_source(folder / "a.vtk"); }).find("a.vtk: "), std::string::npos);
}

TEST(VtkDamageTest, FewerPointsThanDimensions) {
  const TemporaryFolder folder;
  const std::string head = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET ";
  const auto error = [&](const std::string& text) {
    write_bytes(folder / "a.vtk", head + text);
    return error_of([&] { read_vtk_source(folder / "a.vtk"); });
  };
  const std::string points = "POINTS 8 float\n0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1\n";
  EXPECT_EQ(error("STRUCTURED_GRID\nDIMENSIONS 2 2 2\n" + points), "");
  EXPECT_NE(error("STRUCTURED_GRID\nDIMENSIONS 3 3 3\n" + points).find("a.vtk: "), std::string::npos);
  const std::string axes = "X_COORDINATES 2 float\n0 1\nY_COORDINATES 2 float\n0 1\nZ_COORDINATES 2 float\n0 1\n";
  EXPECT_EQ(error("RECTILINEAR_GRID\nDIMENSIONS 2 2 2\n" + axes), "");
  EXPECT_NE(error("RECTILINEAR_GRID\nDIMENSIONS 2 2 3\n" + axes).find("2 of 3 z coordinates"), std::string::npos);
}

/// An XML image whose pieces have these extents, with one number per point.
std::string image_text(const std::string& whole, const std::vector<std::string>& pieces) {
  std::string text =
      "<VTKFile type=\"ImageData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<ImageData WholeExtent=\"" + whole +
      "\" Origin=\"0 0 0\" Spacing=\"1 1 1\">\n";
  for (const std::string& piece : pieces) {
    std::istringstream stream(piece);
    int low, high, points = 1;
    while (stream >> low >> high) points *= high - low + 1;
    text += "<Piece Extent=\"" + piece + "\"><PointData><DataArray type=\"Float64\" Name=\"s\" format=\"ascii\">\n";
    for (int i = 0; i < points; ++i) text += "1 ";
    text += "\n</DataArray></PointData></Piece>\n";
  }
  return text + "</ImageData>\n</VTKFile>\n";
}

TEST(VtkDamageTest, PiecesFillTheExtent) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& whole, const std::vector<std::string>& pieces) {
    write_bytes(folder / "a.vti", image_text(whole, pieces));
    return error_of([&] { read_vtk_source(folder / "a.vti"); });
  };
  const std::string fault = "a.vti: its pieces do not fill its extent";
  EXPECT_EQ(error("0 4 0 3 0 2", {"0 4 0 3 0 2"}), "");
  EXPECT_EQ(error("0 4 0 3 0 2", {"0 2 0 3 0 2", "2 4 0 3 0 2"}), "");
  EXPECT_EQ(error("-3 4 5 5 0 2", {"-3 2 5 5 0 2", "1 4 5 5 0 2"}), "") << "one layer, overlapping";
  EXPECT_EQ(error("0 4 5 5 2 2", {"0 1 5 5 2 2", "1 4 5 5 2 2"}), "") << "one row";
  EXPECT_EQ(error("1 1 5 5 2 2", {"1 1 5 5 2 2"}), "") << "one point";
  EXPECT_NE(error("0 15 0 15 0 15", {"0 7 0 7 0 7"}).find(fault), std::string::npos);
  EXPECT_NE(error("0 4 0 3 0 2", {"0 2 0 3 0 2", "3 4 0 3 0 2"}).find(fault), std::string::npos) << "a layer of cells";
  EXPECT_NE(error("0 4 0 3 0 0", {"0 2 0 3 0 0"}).find(fault), std::string::npos);
  EXPECT_NE(error("0 4 0 3 0 2", {}).find(fault), std::string::npos);
  EXPECT_NE(error("0 4 0 3 0 2", {"0 2 0 3 0 2", "0 3 0 3 0 2"}).find(fault), std::string::npos) << "twice the same";
}

TEST(VtkDamageTest, PiecesInOtherFilesFillTheExtent) {
  const TemporaryFolder folder;
  const std::string whole = "WholeExtent=\"0 4 0 3 0 2\" Origin=\"0 0 0\" Spacing=\"1 1 1\"";
  const std::string first = "<Piece Extent=\"0 3 0 3 0 2\" Source=\"p0.vti\"/>\n",
                    second = "<Piece Extent=\"2 4 0 3 0 2\" Source=\"p1.vti\"/>\n";
  write_bytes(folder / "p0.vti", image_text("0 4 0 3 0 2", {"0 3 0 3 0 2"}));  // the piece has the extent of the whole
  write_bytes(folder / "p1.vti", image_text("2 4 0 3 0 2", {"2 4 0 3 0 2"}));
  const auto error = [&](const std::string& pieces) {
    write_bytes(folder / "a.pvti", "<VTKFile type=\"PImageData\" version=\"0.1\">\n<PImageData GhostLevel=\"1\" " +
                                       whole +
                                       ">\n<PPointData><PDataArray type=\"Float64\" Name=\"s\"/></PPointData>\n" +
                                       pieces + "</PImageData>\n</VTKFile>\n");
    return error_of([&] { read_vtk_source(folder / "a.pvti"); });
  };
  EXPECT_EQ(error(first + second), "");
  EXPECT_NE(error(first).find("a.pvti: its pieces do not fill its extent"), std::string::npos);
  EXPECT_NE(error_of([&] { read_vtk_source(folder / "p0.vti"); }).find("the file that names it as a piece"),
            std::string::npos);
}

TEST(VtkDamageTest, TruncatedXmlFiles) {
  const TemporaryFolder folder;
  for (const auto& [ending, written] : data_sets()) {
    write_xml(*written, folder / "whole.xml");
    const std::string bytes = bytes_of(folder / "whole.xml");
    for (const double part : {0.01, 0.1, 0.5, 0.9, 0.99}) {
      const std::filesystem::path cut = folder / ("cut" + ending);
      write_bytes(cut, bytes.substr(0, static_cast<std::size_t>(part * static_cast<double>(bytes.size()))));
      EXPECT_FALSE(error_of([&] { read_vtk_source(cut); }).empty()) << ending << part;
    }
  }
}

TEST(VtkDamageTest, TruncatedLegacyFiles) {
  const TemporaryFolder folder;
  for (const auto& [ending, written] : data_sets()) {
    for (const bool binary : {false, true}) {
      written->GetCellData()->Initialize();  // the tensors become the last array of the file
      write_legacy(*written, folder / "whole.vtk", binary);
      const std::string bytes = bytes_of(folder / "whole.vtk");
      // Cut within the tensors: a file that ends between two arrays is a complete file with fewer arrays.
      for (const std::size_t cut : {20, 100, 300}) {
        write_bytes(folder / "cut.vtk", bytes.substr(0, bytes.size() - cut));
        EXPECT_FALSE(error_of([&] { read_vtk_source(folder / "cut.vtk"); }).empty()) << ending << binary << cut;
      }
    }
  }
}

TEST(VtkDamageTest, TruncatedExodusFiles) {
  const std::filesystem::path path = data_file("disk_out_ref/disk_out_ref.ex2");
  SKIP_WITHOUT(path);
  const TemporaryFolder folder;
  const std::string bytes = bytes_of(path);
  for (const std::size_t size :
       {std::size_t{100}, std::size_t{2000}, bytes.size() / 2, bytes.size() * 9 / 10, bytes.size() - 8}) {
    write_bytes(folder / "cut.ex2", bytes.substr(0, size));
    EXPECT_NE(error_of([&] { read_vtk_source(folder / "cut.ex2"); }).find("cut.ex2: "), std::string::npos) << size;
  }
}

/// The message contains VTK's own errors, which VTK would have printed.
TEST(VtkDamageTest, DamageInsideIsThrownAndNotPrinted) {
  const TemporaryFolder folder;
  write_xml(*image(), folder / "a.vti");
  std::string bytes = bytes_of(folder / "a.vti");
  bytes.replace(bytes.find("<PointData"), 10, "<PxintData");
  write_bytes(folder / "a.vti", bytes);
  testing::internal::CaptureStderr();
  const std::string error = error_of([&] { read_vtk_source(folder / "a.vti"); });
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_NE(error.find("a.vti: VTK cannot read it: "), std::string::npos) << error;
  EXPECT_EQ(error.find("0x"), std::string::npos) << error;
}

}  // namespace
}  // namespace tensorray
