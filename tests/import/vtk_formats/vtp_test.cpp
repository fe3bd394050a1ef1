// Paths as VTK polydata: written and read by the program through `tensorray-import`, and damaged files.

#include <random>
#include <set>

#include <vtkFieldData.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataReader.h>

#include "integrators/path_files/path_files.h"
#include "tests/import/velocity_meshes.h"
#include "tests/import/vtk_files.h"
#include "tests/tracing/path_support.h"
#include "tests/volumes/point_support.h"
#include "tools/import/vtk_formats/image_lattice.h"
#include "tools/import/vtk_formats/vtp_files.h"
#include "tracing/paths/cross_section.h"

namespace tensorray {
namespace {

/// Reads a file with these bytes, and expects that nothing is written to the terminal meanwhile.
/// @return the error message; empty if the file was read.
std::string error_of_bytes(const std::string& bytes) {
  const Temporary file("a.vtp", bytes);
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  const std::string text = error_of([&] { read_paths(file); });
  EXPECT_EQ(::testing::internal::GetCapturedStdout() + ::testing::internal::GetCapturedStderr(), "");
  if (!text.empty()) {
    EXPECT_THAT(text, AllOf(StartsWith("cannot read "), HasSubstr(file.string() + ": ")));
  }
  return text;
}

std::string written(const std::vector<Path>& paths) {
  const Temporary file("a.vtp");
  write_paths(file, paths);
  return bytes_of(file);
}

/// Whether VTK reads a file with these bytes: in a child process, which is faster than to start the program.
bool is_taken(const std::string& bytes) {
  const Temporary file("a.vtp", bytes);
  const std::set<std::string> names{"direction", "length", "tensor", "change", "in_field", "wavelength", "end"};
  return error_in_child(file, [&] { read_vtp_file(file, names); }).empty();
}

vtkSmartPointer<vtkPolyData> read_by_vtk(const std::filesystem::path& file) {
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName(file.c_str());
  reader->Update();
  return reader->GetOutput();
}

/// A file as other programs write it: two lines that share a point, and also a vertex and a triangle.
std::string foreign_vtp(const std::string& connectivity = "0 1 2 2 3") {
  const auto cells = [](const std::string& corners, const std::string& offsets) {
    return "<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">" + corners +
           "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">" + offsets + "</DataArray>\n";
  };
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<PolyData>"
         "<Piece NumberOfPoints=\"4\" NumberOfVerts=\"1\" NumberOfLines=\"2\" NumberOfStrips=\"0\" "
         "NumberOfPolys=\"1\">\n<CellData><DataArray type=\"Float32\" Name=\"wavelength\" format=\"ascii\">1 450 650 2"
         "</DataArray></CellData>\n<Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">"
         "0 0 0  1 0 0  2 0 0  2 3 0</DataArray></Points>\n<Verts>" +
         cells("3", "1") + "</Verts><Lines>" + cells(connectivity, "3 5") + "</Lines><Polys>" + cells("0 1 3", "3") +
         "</Polys></Piece></PolyData></VTKFile>\n";
}

TEST(VtpPathsTest, ReadBackExactly) {
  const std::vector<Path> paths = some_paths(12);
  const Temporary file("a.vtp");
  write_paths(file, paths);
  expect_same(read_paths(file), without_empty(paths));
}

TEST(VtpPathsTest, CutFilesFail) {
  const std::string bytes = written(some_paths(3));
  for (std::size_t size = 1; size < bytes.size() - 1; size += 50) {
    EXPECT_FALSE(is_taken(bytes.substr(0, size))) << size;
    if (size % 500 != 1) continue;
    EXPECT_NE(error_of_bytes(bytes.substr(0, size)), "") << size;
  }
  EXPECT_TRUE(is_taken(bytes.substr(0, bytes.size() - 1)));  // Only the last line end is missing.
}

TEST(VtpPathsTest, DamagedFilesNeverCrash) {
  const std::string bytes = written(some_paths(3));
  std::mt19937 engine(7);
  for (int i = 0; i < 100; ++i) {
    std::string changed = i % 2 ? bytes : foreign_vtp();
    for (int j = 0; j < 1 + i % 3; ++j) changed[engine() % changed.size()] = static_cast<char>(engine());
    if (is_taken(changed) || i % 10 == 0) error_of_bytes(changed);
  }
}

TEST(VtpPathsTest, LinesOfOtherPrograms) {
  const std::vector<Path> paths = read_paths(Temporary("a.vtp", foreign_vtp()));
  ASSERT_EQ(paths.size(), 2u);
  EXPECT_EQ(paths[0].wavelength, 450);
  EXPECT_EQ(paths[1].wavelength, 650);
  EXPECT_EQ(paths[0].backward_end, std::nullopt);
  ASSERT_EQ(paths[0].points.size(), 3u);
  ASSERT_EQ(paths[1].points.size(), 2u);
  EXPECT_EQ(paths[1].points[1].position, Eigen::Vector3d(2, 3, 0));
  EXPECT_EQ(paths[1].points[1].length, 3);
  for (const PathPoint& point : paths[0].points) {
    EXPECT_EQ(point.direction, Eigen::Vector3d::UnitX());
    EXPECT_TRUE(point.tensor.isZero(0) && point.change.isZero(0));
  }
}

TEST(VtpPathsTest, ErrorsNameTheFix) {
  EXPECT_THAT(error_of_bytes("solid nothing of the kind\n"), HasSubstr("not VTK polydata"));
  for (const char* connectivity : {"0 1 2 2 4", "0 1 2 2 -1"})
    EXPECT_THAT(error_of_bytes(foreign_vtp(connectivity)), HasSubstr("not there")) << connectivity;
  EXPECT_THAT(error_of_bytes(foreign_vtp("0 1 2 2")), HasSubstr("damaged"));
  struct Row {
    const char *from, *to, *words;  ///< Empty words: any error.
  };
  for (const Row& row : {Row{"type=\"PolyData\"", "type=\"Image\nData\"", "not VTK polydata but \"Image\\nData\""},
                         {"3 5<", "3 9000000000000000000<", "damaged"},
                         {"3 5<", "3 2000000000<", "damaged"},
                         {"3 5<", "5 3<", ""},
                         {"1 0 0", "1 nan 0", ""},
                         {"NumberOfPoints=\"4\"", "NumberOfPoints=\"4000000000\"", "damaged"},
                         {"NumberOfComponents=\"3\"", "NumberOfComponents=\"2000000000\"", ""},
                         {"NumberOfComponents=\"3\"", "NumberOfComponents=\"-9\"", ""},
                         {"NumberOfLines=\"2\"", "NumberOfLines=\"0\"", "no path"}})
    EXPECT_THAT(error_of_bytes(replaced(foreign_vtp(), row.from, row.to)), AllOf(Not(""), HasSubstr(row.words)))
        << row.to;

  const auto refuses = [](const std::function<void(PathPoint&)>& spoil, const char* words) {
    std::vector<Path> paths = some_paths(3);
    spoil(paths[2].points[1]);
    EXPECT_THAT(error_of_bytes(written(paths)), HasSubstr(words));
  };
  refuses([](PathPoint& point) { point.position.y() = NAN; }, "point 3 of its lines is not finite");
  refuses([](PathPoint& point) { point.tensor(0, 1) = NAN; }, "\"tensor\" has a value that is not finite");
  refuses([](PathPoint& point) { point.length = 0; }, "\"length\" does not grow");
}

TEST(VtpPathsTest, PiecesThatDoNotHaveTheSameArrays) {
  std::string both = foreign_vtp();
  const std::size_t begin = both.find("<Piece"), end = both.find("</PolyData>");
  both.insert(end, replaced(both.substr(begin, end - begin), "wavelength", "wave_number"));
  std::vector<Path> paths;
  const std::string error = error_of([&] { paths = read_paths(Temporary("a.vtp", both)); });
  if (error.empty()) {
    ASSERT_EQ(paths.size(), 4u);
    for (const Path& path : paths) EXPECT_EQ(path.wavelength, Path().wavelength);
  }
}

TEST(VtpPathsTest, VtkReadsThem) {
  const std::vector<Path> paths = some_paths(4);
  const Temporary file("paths.vtp");
  write_paths(file, paths);
  const auto data = read_by_vtk(file);
  vtkPointData& points = *data->GetPointData();
  vtkCellData& lines = *data->GetCellData();
  EXPECT_EQ(data->GetNumberOfPoints(), 14);
  EXPECT_EQ(data->GetNumberOfLines(), 4);
  EXPECT_EQ(data->GetNumberOfCells(), 4);
  for (const char* name : {"backward_end", "end", "flexibility", "wavelength"})
    EXPECT_TRUE(lines.HasArray(name)) << name;
  auto* const names = vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray("end_names"));
  ASSERT_TRUE(names);
  EXPECT_EQ(names->GetValue(static_cast<vtkIdType>(lines.GetArray("end")->GetTuple1(2))), "obstacle");
  EXPECT_EQ(lines.GetArray("backward_end")->GetTuple1(2), -1);
  EXPECT_EQ(data->GetCell(1)->GetPointId(2), 4);
  const PathPoint& point = paths[2].points[2];  // The last point of the second polyline: point 4 of the file.
  const auto section = cross_sections(paths[2].points, {1, 1e-300, 1e300})[2];
  const auto expect = [&](const char* name, int component, double value, double tolerance) {
    ASSERT_TRUE(points.HasArray(name)) << name;
    EXPECT_NEAR(points.GetArray(name)->GetComponent(4, component), value, tolerance) << name;
  };
  EXPECT_EQ(data->GetPoint(4)[0], point.position.x());
  expect("tensor", 1, point.tensor(0, 1), 0);
  expect("force", 0, point.force().x(), 2e-6);
  expect("axis_major", 2, section.major.z(), 2e-6);
  expect("curvature", 0, point.change.norm(), 2e-6);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(points.GetArray("axis_minor")->GetComponent(2, i), 0);
}

TEST(VtpPoints, HoldEveryPointAndAttribute) {
  const PointCloud cloud = cloud_of(3000, 0);
  const Temporary file("a.vtp");
  write_points(file, cloud);
  const auto read = read_by_vtk(file);
  vtkPointData& data = *read->GetPointData();
  ASSERT_EQ(read->GetNumberOfPoints(), 3000);
  ASSERT_EQ(read->GetNumberOfVerts(), 3000);
  EXPECT_STREQ(data.GetScalars()->GetName(), "wavelength");  // What ParaView shows at first.
  EXPECT_EQ(read->GetCell(1234)->GetNumberOfPoints(), 1);
  EXPECT_EQ(read->GetCell(1234)->GetPointId(0), 1234);
  std::vector<Record> records;
  const auto vector = [](const double* v) { return Eigen::Vector3d(v[0], v[1], v[2]).cast<float>().eval(); };
  for (vtkIdType i = 0; i < 3000; ++i)
    records.emplace_back(data.GetArray("power")->GetTuple1(i), vector(read->GetPoint(i)),
                         data.GetArray("wavelength")->GetTuple1(i), vector(data.GetArray("direction")->GetTuple3(i)));
  expect_records(records, cloud, 0);
  for (const auto& [key, value] : cloud.metadata) {
    auto* text = vtkStringArray::SafeDownCast(read->GetFieldData()->GetAbstractArray(key.c_str()));
    ASSERT_NE(text, nullptr) << key;
    EXPECT_EQ(text->GetValue(0), value);
  }
}

TEST(VtpPoints, FullDiskIsNoticed) { expect_full_disk_is_noticed("a.vtp"); }

/// Component c of value i is 100 i + c.
vtkSmartPointer<vtkDataArray> counting(int type, int components, vtkIdType tuples) {
  const auto array = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(type));
  array->SetName("stress");
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(tuples);
  for (int i = 0; i < tuples; ++i)
    for (int c = 0; c < components; ++c) array->SetComponent(i, c, 100 * i + c);
  return array;
}

vtkSmartPointer<vtkImageData> oblique_image() {
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetExtent(2, 5, -1, 1, 7, 11);  // 4 x 3 x 5
  image->SetOrigin(10, -20, 30);
  image->SetSpacing(0.5, 2, 3);
  const double c = std::cos(0.7), s = std::sin(0.7);
  image->SetDirectionMatrix(c, -s, 0, s, c, 0, 0, 0, -1);
  return image;
}

/// Points are where VTK has them, and cells at their centres.
TEST(ImageLatticeTest, ValuesAreWhereVtkHasThem) {
  for (const bool of_cells : {false, true}) {
    const auto image = oblique_image();
    const vtkIdType count = of_cells ? image->GetNumberOfCells() : image->GetNumberOfPoints();
    const int components = of_cells ? 6 : 9;
    const auto array = counting(of_cells ? VTK_DOUBLE : VTK_FLOAT, components, count);
    const Lattice lattice = lattice_of(image, array, of_cells);
    const Eigen::Vector3i size = of_cells ? Eigen::Vector3i(3, 2, 4) : Eigen::Vector3i(4, 3, 5);
    EXPECT_EQ(lattice.size, size);
    EXPECT_EQ(lattice.components, components);
    EXPECT_EQ(lattice.array, "stress");
    EXPECT_EQ(lattice.frame, Eigen::Matrix3d::Identity());
    for (int i = 0; i < count; ++i) {
      const Vector3d expected = of_cells ? mesh_fixtures::mean_of(*image->GetCell(i)) : Vector3d(image->GetPoint(i));
      const Vector3d index(i % size.x(), i / size.x() % size.y(), i / size.x() / size.y());
      EXPECT_LT((lattice.to_world * index - expected).norm(), 1e-13);
    }
    const int of_slice = size.x() * size.y() * components;
    std::vector<double> values(static_cast<std::size_t>(of_slice));
    for (int z = size.z() - 1; z >= 0; --z) {
      lattice.read_slice(z, values.data());
      for (int i = 0; i < of_slice; ++i)
        EXPECT_EQ(values[i], 100 * (z * size.x() * size.y() + i / components) + i % components);
    }
  }
}

TEST(ImageLatticeTest, ImagesThatCannotBe) {
  const auto image = oblique_image();
  const auto array = counting(VTK_FLOAT, 9, image->GetNumberOfPoints() - 1);
  const auto error = [&] { return error_of([&] { lattice_of(image, array, false); }); };
  EXPECT_THAT(error(), HasSubstr("59 values"));
  image->SetSpacing(1, 0, 1);
  EXPECT_THAT(error(), HasSubstr("spacing"));
}

}  // namespace
}  // namespace tensorray
