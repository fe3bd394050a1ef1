// Files that VTK would read wrongly, or that would crash it, are errors before or after VTK reads them. All are read in
// child processes: no file ends the other tests.

#include "tests/import/vtk_files.h"

namespace tensorray {
namespace {

class VtkDamage : public testing::Test {
 protected:
  /// The error of a file with these bytes.
  std::string error(const std::string& name, const std::string& bytes) const {
    write_bytes(folder_ / name, bytes);
    return read_error(folder_ / name);
  }

  /// The bytes of a data set's XML file.
  std::string xml_of(vtkDataSet& set, Mode mode = Mode::raw_compressed) const {
    write_xml(set, folder_ / "set.xml", mode);
    return bytes_of(folder_ / "set.xml");
  }

  TemporaryFolder folder_;
};

TEST_F(VtkDamage, FilesThatAreNotWhatTheirEndingSays) {
  const std::string grid = xml_of(*structured());
  for (const char* name : {"a.vtk", "a.vti", "a.vtr", "a.vtu", "a.pvti", "a.pvtu", "a.ex2", "a.e", "a.foam"})
    EXPECT_THAT(error(name, grid), AllOf(HasSubstr(std::string(name) + ": its ending says "),
                                         HasSubstr("a VTK structured grid; give it the ending .vts")));
  EXPECT_EQ(error("grid.xml", grid), "");
  for (const char* supported : {"ExodusII", ".nrrd", ".nii", ".npy", "PLOT3D needs two files, the grid and its q"})
    EXPECT_THAT(error("unknown.abc", "of no kind"), HasSubstr(supported));
  for (const std::string name : {"b.vtk", "b.vti", "b.vts", "b.pvtu", "b.ex2", "b.abc"}) {
    EXPECT_THAT(error(name, std::string(5000, 'x') + '\x01'), HasSubstr(name + ": is n"));
    EXPECT_THAT(error(name, ""), HasSubstr("is empty"));
  }
  EXPECT_THAT(read_error(folder_ / "none.vtk"), HasSubstr("does not exist"));
  for (const auto& [name, words] : {std::pair("a.odb", "odb2vtk"),
                                    {"a.rst", "ansys-mapdl-reader"},
                                    {"a.mgz", "mri_convert"},
                                    {"a.FIB.gz", "dtifit --save_tensor"},
                                    {"a.mnc", "mnc2nii"},
                                    {"a.cas.h5", "EnSight Gold"},
                                    {"a.stl", "is a surface"},
                                    {"a.vdb", "needs no import"}})
    EXPECT_THAT(error(name, "\x1f\x8b of any kind"), AllOf(HasSubstr(name), HasSubstr(words)));
  EXPECT_THAT(error("a.mnc", "CDF\x01 of any kind"), HasSubstr("mnc2nii"));
  EXPECT_THAT(error("surface.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 0 float\n"),
              HasSubstr("surfaces"));
  EXPECT_THAT(error("surface.vtp", "<VTKFile type=\"Poly\nData\x1b\"></VTKFile>"), HasSubstr("'Poly\\nData\\x1b'"));
}

/// netCDF fails on this header, and also prints messages about it; the message of VTK contains its own errors.
TEST_F(VtkDamage, NothingButTheErrorIsSaid) {
#ifdef TENSORRAY_SANITIZED
  GTEST_SKIP() << "the sanitizer's report is not to be lost, so that nothing is silenced";
#endif
  const std::string damaged = replaced_text(xml_of(*image()), "<PointData", "<PxintData");
  testing::internal::CaptureStderr();
  EXPECT_THAT(error("a.vti", damaged), AllOf(HasSubstr("a.vti: VTK cannot read it: "), testing::Not(HasSubstr("0x"))));
  const std::filesystem::path data = data_file("disk_out_ref/disk_out_ref.ex2");
  using Change = std::pair<std::size_t, int>;
  for (const std::vector<Change>& changes : std::vector<std::vector<Change>>{
           {{4201, 185}, {1214, 174}, {2258, 47}}, {{2049, 233}, {5332, 215}, {1192, 28}}, {{5993, 67}, {873, 86}}}) {
    if (!std::filesystem::exists(data)) continue;
    std::string bytes = bytes_of(data);
    for (const auto& [at, value] : changes) bytes[at] = static_cast<char>(value);
    EXPECT_NE(error("a.ex2", bytes), "");
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

std::string legacy(const std::string& data_set) { return "# vtk DataFile Version 3.0\nt\nASCII\nDATASET " + data_set; }

std::string tetrahedron(const std::string& points, const std::string& cells, const std::string& type = "10") {
  return legacy("UNSTRUCTURED_GRID\nPOINTS 4 double\n" + points + "\nCELLS 1 " + cells + "\nCELL_TYPES 1\n" + type +
                "\nPOINT_DATA 4\nSCALARS s double\nLOOKUP_TABLE default\n1 2 3 4\n");
}

TEST_F(VtkDamage, CellsOfPointsThatAreNotThere) {
  const std::string points = "0 0 0 1 0 0 0 1 0 0 0 1";
  const auto of_cell = [&](const std::string& cells, const std::string& type) {
    return error("a.vtk", tetrahedron(points, cells, type));
  };
  EXPECT_EQ(of_cell("5\n4 0 1 2 3", "10"), "");
  for (const std::string id : {"4", "50", "3000000", "-1"})
    EXPECT_DAMAGED(of_cell("5\n4 0 1 2 " + id, "10"),
                   "a.vtk: is damaged, or not of the form it seems: a cell has point " + id + " of 4");
  EXPECT_DAMAGED(of_cell("4\n3 0 1 2", "10"), "cell 0 has fewer points");
  const std::string faces = "4 3 0 1 2 3 0 3 1 3 1 3 2 3 0 2 ";  // the faces of a polyhedron
  EXPECT_EQ(of_cell("18\n17 " + faces + "3", "42"), "");
  EXPECT_DAMAGED(of_cell("18\n17 " + faces + "9", "42"), "a.vtk: ");
}

/// Faces with other points than their cell has. Only XML files can contain such faces.
TEST_F(VtkDamage, FacesOfPointsThatAreNotThere) {
  const auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  vtkNew<vtkPoints> points;
  for (int i = 0; i < 4; ++i) points->InsertNextPoint(i == 1, i == 2, i == 3);
  grid->SetPoints(points);
  const vtkIdType corners[] = {0, 1, 2, 3}, faces[] = {3, 0, 1, 2, 3, 0, 3, 1, 3, 1, 3, 2, 3, 0, 2, 3};
  grid->InsertNextCell(VTK_POLYHEDRON, 4, corners, 4, faces);
  const std::string bytes = xml_of(*grid, Mode::ascii);
  EXPECT_EQ(error("a.vtu", bytes), "");
  for (const std::size_t number : {0, 2, 8}) {  // Of faces, of the first one's points, and one of its points.
    std::string damaged = bytes;
    damaged[bytes.find("4 3 0 1 2 3\n") + number] = '9';
    EXPECT_DAMAGED(error("a.vtu", damaged), "a.vtu: ");
  }
}

TEST_F(VtkDamage, CoordinatesThatAreNotFiniteOrTooLarge) {
  for (const double wrong : {std::nan(""), HUGE_VAL, -1e31}) {
    const auto cubes = bar(0, 2);
    cubes->GetPoints()->SetPoint(5, 1, wrong, 0);
    const auto curved = structured();
    curved->GetPoints()->SetPoint(7, 0, 0, wrong);
    const auto straight = rectilinear();
    straight->GetYCoordinates()->SetComponent(1, 0, wrong);
    const auto moved = image(), stretched = image();
    moved->SetOrigin(0, wrong, 0);
    stretched->SetSpacing(1, 1, wrong);
    for (const auto& [set, name, place] : std::vector<std::tuple<vtkDataSet*, const char*, const char*>>{
             {cubes, "a.vtu", "a.vtu: is damaged, or not of the form it seems: point 5 "},
             {curved, "a.vts", "point 7 "},
             {straight, "a.vtr", "y coordinate 1 "},
             {moved, "a.vti", "origin"},
             {stretched, "b.vti", "spacing"}})
      EXPECT_THAT(error(name, xml_of(*set)), AllOf(HasSubstr(place), HasSubstr("not finite, or beyond 1e30")));
  }
  EXPECT_EQ(error("a.vtk", tetrahedron("0 0 0 1e29 0 0 0 1 0 0 0 -1e29", "5\n4 0 1 2 3")), "");
  EXPECT_DAMAGED(error("a.vtk", tetrahedron("0 0 0 1 0 0 0 1 0 0 0 nan", "5\n4 0 1 2 3")), "a.vtk: ");
}

TEST_F(VtkDamage, FewerPointsThanDimensions) {
  const std::string points = "POINTS 8 float\n0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1\n";
  const std::string axes = "X_COORDINATES 2 float\n0 1\nY_COORDINATES 2 float\n0 1\nZ_COORDINATES 2 float\n0 1\n";
  EXPECT_EQ(error("a.vtk", legacy("STRUCTURED_GRID\nDIMENSIONS 2 2 2\n" + points)), "");
  EXPECT_DAMAGED(error("a.vtk", legacy("STRUCTURED_GRID\nDIMENSIONS 3 3 3\n" + points)), "a.vtk: ");
  EXPECT_EQ(error("a.vtk", legacy("RECTILINEAR_GRID\nDIMENSIONS 2 2 2\n" + axes)), "");
  EXPECT_DAMAGED(error("a.vtk", legacy("RECTILINEAR_GRID\nDIMENSIONS 2 2 3\n" + axes)), "2 of 3 z coordinates");
}

/// Words of a title, and names that are numbers, announce nothing; small files that announce billions are refused soon.
TEST_F(VtkDamage, CountsBeyondTheFile) {
  const std::string head =
      "\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 1 1\nORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA 2\n";
  for (const char* title : {"Field of 20240517 after the run", "Points 20240517", "CELLS 1e9"})
    EXPECT_EQ(error("a.vtk", "# vtk DataFile Version 3.0\n" + std::string(title) + head +
                                 "FIELD 20240517 1\n20240517 1 2 float\n1 2\n"),
              "");
  for (const char* count : {"100000000", "2000000000"}) {
    EXPECT_THAT(error("a.vtk", "# vtk DataFile Version 3.0\nt" + head + "FIELD f " + count + "\na 1 2 float\n1 2\n"),
                HasSubstr("a.vtk: is damaged or cut off: it announces \"FIELD f "));
    const std::string xml = xml_of(*bar(0, 1), Mode::ascii), quoted = "=\"" + std::string(count) + "\"";
    EXPECT_DAMAGED(error("a.vtu", replaced_text(xml, "NumberOfPoints=\"8\"", "NumberOfPoints" + quoted)), "a.vtu: ");
    EXPECT_THAT(error("a.vtu", replaced_text(xml, "NumberOfComponents=\"9\"", "NumberOfComponents" + quoted)),
                HasSubstr("no such number of components"));
  }
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

TEST_F(VtkDamage, PiecesFillTheExtent) {
  struct Case {
    std::string whole;
    std::vector<std::string> pieces;
    bool fills;
  };
  for (const Case& one :
       std::vector<Case>{{"0 4 0 3 0 2", {"0 4 0 3 0 2"}, true},
                         {"0 4 0 3 0 2", {"0 2 0 3 0 2", "2 4 0 3 0 2"}, true},
                         {"-3 4 5 5 0 2", {"-3 2 5 5 0 2", "1 4 5 5 0 2"}, true},  // One layer, overlapping.
                         {"0 4 5 5 2 2", {"0 1 5 5 2 2", "1 4 5 5 2 2"}, true},    // One row.
                         {"1 1 5 5 2 2", {"1 1 5 5 2 2"}, true},                   // One point.
                         {"0 15 0 15 0 15", {"0 7 0 7 0 7"}, false},
                         {"0 4 0 3 0 2", {"0 2 0 3 0 2", "3 4 0 3 0 2"}, false},  // Without a layer of cells.
                         {"0 4 0 3 0 0", {"0 2 0 3 0 0"}, false},
                         {"0 4 0 3 0 2", {}, false},
                         {"0 4 0 3 0 2", {"0 2 0 3 0 2", "0 3 0 3 0 2"}, false}}) {  // A part twice.
    const std::string text = error("a.vti", image_text(one.whole, one.pieces));
    EXPECT_EQ(text.find("a.vti: its pieces do not fill its extent") == std::string::npos, one.fills) << text;
    EXPECT_EQ(text.empty(), one.fills) << text;
  }
}

TEST_F(VtkDamage, PiecesInOtherFilesFillTheExtent) {
  const std::string whole = "WholeExtent=\"0 4 0 3 0 2\" Origin=\"0 0 0\" Spacing=\"1 1 1\"";
  const std::string first = "<Piece Extent=\"0 3 0 3 0 2\" Source=\"p0.vti\"/>\n",
                    second = "<Piece Extent=\"2 4 0 3 0 2\" Source=\"p1.vti\"/>\n";
  // The first piece has the extent of the whole.
  EXPECT_THAT(error("p0.vti", image_text("0 4 0 3 0 2", {"0 3 0 3 0 2"})),
              HasSubstr("the file that names it as a piece"));
  EXPECT_EQ(error("p1.vti", image_text("2 4 0 3 0 2", {"2 4 0 3 0 2"})), "");
  const auto of_pieces = [&](const std::string& pieces) {
    return error("a.pvti", "<VTKFile type=\"PImageData\" version=\"0.1\">\n<PImageData GhostLevel=\"1\" " + whole +
                               ">\n<PPointData><PDataArray type=\"Float64\" Name=\"s\"/></PPointData>\n" + pieces +
                               "</PImageData>\n</VTKFile>\n");
  };
  EXPECT_EQ(of_pieces(first + second), "");
  EXPECT_THAT(of_pieces(first), HasSubstr("a.pvti: its pieces do not fill its extent"));
}

TEST_F(VtkDamage, FilesThatAreCutOff) {
  for (const auto& [ending, written] : data_sets()) {
    const std::string xml = xml_of(*written);
    for (const double part : {0.01, 0.5, 0.99})
      EXPECT_NE(error("cut" + ending, xml.substr(0, static_cast<std::size_t>(part * static_cast<double>(xml.size())))),
                "")
          << ending << part;
  }
  // Fresh data sets: the XML writer leaves keys in arrays, which a legacy file would have after the tensors.
  for (const auto& [ending, written] : data_sets()) {
    written->GetCellData()->Initialize();  // The tensors become the last array of the file.
    for (const bool binary : {false, true}) {
      write_legacy(*written, folder_ / "whole.vtk", binary);
      const std::string bytes = bytes_of(folder_ / "whole.vtk");
      // Within the tensors: a file that ends between two arrays is a complete file with fewer arrays.
      for (const std::size_t cut : {20, 300})
        EXPECT_NE(error("cut.vtk", bytes.substr(0, bytes.size() - cut)), "") << ending << binary << cut;
    }
  }
  const std::filesystem::path exodus = data_file("disk_out_ref/disk_out_ref.ex2");
  SKIP_WITHOUT(exodus);
  const std::string bytes = bytes_of(exodus);
  for (const std::size_t size : {std::size_t{100}, std::size_t{2000}, bytes.size() / 2, bytes.size() - 8})
    EXPECT_THAT(error("cut.ex2", bytes.substr(0, size)), HasSubstr("cut.ex2: ")) << size;
}

}  // namespace
}  // namespace tensorray
