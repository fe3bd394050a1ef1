// Polyhedra as VTK 9.4 writes them: in four arrays of faces.

#include <regex>

#include <gmock/gmock.h>
#include <vtkCellData.h>
#include <vtkLongLongArray.h>

#include "base/process/progress.h"
#include "tests/import/hdf5_writer.h"
#include "tests/import/mesh_files.h"
#include "tests/import/mesh_fixtures.h"
#include "tests/import/vtk_files.h"
#include "tools/import/import_file.h"

namespace tensorray {
namespace {

using Ints = std::vector<int>;
using Grid = vtkSmartPointer<vtkUnstructuredGrid>;

/// The faces of a cube with the corners of `bar`, which are those of cube i from 4 i on.
const std::vector<Ints> cube_faces{{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};

/// Those of a bar of two cubes, which has the first one as a hexahedron.
struct Faces {
  Ints connectivity, offsets, of_cells{0, 1, 2, 3, 4, 5}, cells{0, 6};
};

Faces faces_of_second() {
  Faces result;
  for (const Ints& face : cube_faces) {
    for (const int corner : face) result.connectivity.push_back(4 + corner);
    result.offsets.push_back(static_cast<int>(result.connectivity.size()));
  }
  return result;
}

/// A hexahedron, and a polyhedron.
Grid mixed_bar() {
  const Grid bars = bar(0, 2), mixed = Grid::New();
  mixed->SetPoints(bars->GetPoints());
  vtkNew<vtkIdList> corners, stream;
  bars->GetCellPoints(0, corners);
  mixed->InsertNextCell(VTK_HEXAHEDRON, corners);
  stream->InsertNextId(6);
  for (const Ints& face : cube_faces) {
    stream->InsertNextId(4);
    for (const int corner : face) stream->InsertNextId(4 + corner);
  }
  mixed->InsertNextCell(VTK_POLYHEDRON, stream);
  return with_arrays(mixed);
}

void expect_linear(const std::filesystem::path& path, std::size_t voxels) {
  ImportSettings settings;
  settings.files = {path};
  settings.array = "tensor";
  settings.sampling.resolution = 0.25;
  ImportReport report;
  const TensorGrid grid = import_tensors(settings, Progress(), report);
  EXPECT_EQ(grid.active_voxels(), voxels);
  mesh_fixtures::for_each_voxel(grid, [](const Eigen::Vector3d& x, const Eigen::Matrix3d& tensor) {
    EXPECT_NEAR(tensor(1, 2), number(x.data(), 5), 1e-4) << x.transpose();
  });
}

TEST(Polyhedra, OfVtk94AreReadInAllFormsOfItsXml) {
  const TemporaryFolder folder;
  const Faces faces = faces_of_second();
  for (const Mode mode : {Mode::ascii, Mode::binary, Mode::raw_compressed, Mode::raw_plain}) {
    const Grid grid = mixed_bar();
    for (const auto& [name, values] : {std::pair("face_connectivity", &faces.connectivity),
                                       {"face_offsets", &faces.offsets},
                                       {"polyhedron_to_faces", &faces.of_cells},
                                       {"polyhedron_offsets", &faces.cells}}) {
      vtkNew<vtkLongLongArray> array;
      array->SetName(name);
      for (const int value : *values) array->InsertNextValue(value);
      grid->GetFieldData()->AddArray(array);
    }
    write_xml(*grid, folder / "a.vtu", mode);
    std::string text = bytes_of(folder / "a.vtu");
    // What the installed version writes as fields is moved among the cells, and its own arrays of faces are renamed.
    const std::size_t begin = text.find("<FieldData>") + 11, end = text.find("</FieldData>");
    ASSERT_LT(begin, end);
    const std::string moved = text.substr(begin, end - begin);
    for (const char* own : {"\"faces\"", "\"faceoffsets\""})
      if (text.find(own) != std::string::npos) text[text.find(own) + 1] = 'x';
    text.insert(text.find("</Cells>"), moved);
    text.erase(begin, end - begin);
    write_bytes(folder / "a.vtu", text);
    expect_linear(folder / "a.vtu", 9 * 5 * 5);
    write_bytes(folder / "a.pvtu",
                "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid><Piece Source=\"a.vtu\"/>"
                "</PUnstructuredGrid></VTKFile>");
    expect_linear(folder / "a.pvtu", 9 * 5 * 5);
    if (mode != Mode::ascii) continue;
    const std::size_t at = text.find('>', text.find("Name=\"polyhedron_to_faces\"")) + 1;
    write_bytes(folder / "a.vtu", text.replace(text.find('5', at), 1, "9"));
    EXPECT_THAT(read_error(folder / "a.vtu"), testing::HasSubstr("its polyhedra name faces that are not there"));
  }
}

TEST(Polyhedra, OfVtkHdfAreReadOfEachPart) {
  const TemporaryFolder folder;
  const Faces one = faces_of_second();
  {
    Hdf5Writer file(folder / "a.vtkhdf");
    const auto twice = [&](const std::string& name, const Ints& values) {
      Ints both = values;
      both.insert(both.end(), values.begin(), values.end());
      file.write("/VTKHDF/" + name, {both.size()}, both);
    };
    const auto from_zero = [](Ints ends) {
      ends.insert(ends.begin(), 0);
      return ends;
    };
    file.group("/VTKHDF");
    file.attribute("/VTKHDF", "Version", std::vector<double>{2, 5});
    file.attribute("/VTKHDF", "Type", "UnstructuredGrid");
    twice("NumberOfPoints", {12});
    twice("NumberOfCells", {2});
    twice("NumberOfConnectivityIds", {16});
    twice("NumberOfFaces", {6});
    twice("NumberOfFaceConnectivityIds", {24});
    twice("NumberOfPolyhedronToFaceIds", {6});
    twice("Connectivity", {0, 4, 5, 1, 2, 6, 7, 3, 4, 5, 6, 7, 8, 9, 10, 11});
    twice("Offsets", {0, 8, 16});
    twice("Types", {12, 42});
    twice("FaceConnectivity", one.connectivity);
    twice("FaceOffsets", from_zero(one.offsets));
    twice("PolyhedronToFaces", one.of_cells);
    twice("PolyhedronOffsets", from_zero(one.cells));
    std::vector<double> points, values;
    for (int i = 0; i < 24; ++i) {
      const double x[] = {double(i / 4 - i / 12), double(i % 2), double(i / 2 % 2)};
      points.insert(points.end(), x, x + 3);
      for (int c = 0; c < 9; ++c) values.push_back(number(x, c));
    }
    file.write("/VTKHDF/Points", {24, 3}, points);
    file.write("/VTKHDF/PointData/tensor", {24, 9}, values);
  }
  expect_linear(folder / "a.vtkhdf", 17 * 5 * 5);
}

}  // namespace
}  // namespace tensorray
