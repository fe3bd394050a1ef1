#include "tools/import/vtk_source/vtk_source.h"

#include <vtkLongLongArray.h>
#include <vtkUnsignedCharArray.h>
#include <vtk_cgns.h>
// clang-format off
#include VTK_CGNS(cgnslib.h)
// clang-format on

#include "tests/import/hdf5_writer.h"
#include "tests/import/openfoam_case.h"
#include "tests/import/velocity_meshes.h"
#include "tests/import/vtk_files.h"
#include "tools/import/meshes/mesh_tensors.h"

namespace tensorray {
namespace {

using Ints = std::vector<int>;
using Grid = vtkSmartPointer<vtkUnstructuredGrid>;

TEST(VtkSourceTest, FilesOfEveryEncoding) {
  const TemporaryFolder folder;
  constexpr double exact = 0x1p-1000;
  for (const auto& [ending, written] : data_sets()) {
    SCOPED_TRACE(ending);
    for (const Mode mode : {Mode::ascii, Mode::binary, Mode::raw_compressed, Mode::raw_plain}) {
      write_xml(*written, folder / ("file" + ending), mode);
      const auto read = read_vtk_source(folder / ("file" + ending));
      EXPECT_STREQ(read->GetClassName(), written->GetClassName());
      expect_same(*read, *written, mode == Mode::ascii ? 1e-9 : exact);
    }
    for (const bool binary : {false, true}) {
      write_legacy(*written, folder / "file.vtk", binary);
      const auto read = read_vtk_source(folder / "file.vtk");
      EXPECT_TRUE(read->IsA(written->GetClassName())) << read->GetClassName();
      expect_same(*read, *written, binary ? exact : 1e-5);  // VTK writes ASCII with six or more digits
    }
  }
}

TEST(VtkSourceTest, UnstructuredPiecesAreMergedAndGhostCellsRemoved) {
  const TemporaryFolder folder;
  const auto first = bar(0, 3), second = bar(2, 3);  // both have the cube from 2 to 3; the first owns it
  second->AllocateCellGhostArray()->SetValue(0, vtkDataSetAttributes::DUPLICATECELL);
  second->AllocatePointGhostArray()->SetValue(5, vtkDataSetAttributes::DUPLICATEPOINT);
  write_xml(*first, folder / "p0.vtu");
  write_xml(*second, folder / "p1.vtu");
  write_bytes(folder / "all.pvtu",
              "<VTKFile type=\"PUnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><PUnstructuredGrid "
              "GhostLevel=\"0\"><PPointData><PDataArray type=\"Float64\" Name=\"tensor\" NumberOfComponents=\"9\"/>"
              "</PPointData><PPoints><PDataArray type=\"Float64\" NumberOfComponents=\"3\"/></PPoints>"
              "<Piece Source=\"p0.vtu\"/><Piece Source=\"p1.vtu\"/></PUnstructuredGrid></VTKFile>\n");
  const auto read = read_vtk_source(folder / "all.pvtu");
  EXPECT_EQ(read->GetNumberOfCells(), 5);
  EXPECT_EQ(read->GetNumberOfPoints(), 24);
  EXPECT_FALSE(read->HasAnyGhostPoints());
  for (vtkIdType i = 0; i < read->GetNumberOfPoints(); ++i)
    EXPECT_EQ(read->GetPointData()->GetArray("tensor")->GetComponent(i, 4), number(read->GetPoint(i), 4));

  std::filesystem::remove(folder / "p1.vtu");
  EXPECT_THAT(read_error(folder / "all.pvtu"), HasSubstr("p1.vtu is missing"));
  write_xml(*image(), folder / "image.vti");
  std::filesystem::rename(folder / "image.vti", folder / "p1.vtu");
  EXPECT_THAT(read_error(folder / "all.pvtu"), HasSubstr("p1.vtu: "));
}

TEST(VtkSourceTest, ExodusMeshIsNotMovedByItsArrays) {
  const std::filesystem::path path = data_file("disk_out_ref/disk_out_ref.ex2");
  SKIP_WITHOUT(path);
  const auto read = read_vtk_source(path);
  EXPECT_TRUE(read->IsA("vtkUnstructuredGrid"));
  EXPECT_EQ(read->GetNumberOfCells(), 7472);
  for (vtkIdType i = 0; i < 7472; ++i) ASSERT_EQ(read->GetCellType(i), VTK_HEXAHEDRON);
  ASSERT_TRUE(read->GetPointData()->GetArray("V"));
  EXPECT_EQ(read->GetPointData()->GetArray("V")->GetNumberOfComponents(), 3);
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_NEAR(read->GetBounds()[2 * axis], -5.75, 1e-5);
    EXPECT_NEAR(read->GetBounds()[2 * axis + 1], 5.75, 1e-5);
  }
}

TEST(VtkSourceTest, OpenFoamCase) {
  const TemporaryFolder folder;
  OpenFoamCase::write(folder);
  write_bytes(folder / "case.foam", "");
  // Component c of the first `count` values must be the component order[c] of the file.
  const auto expect_order = [](vtkDataArray& array, int count, const Ints& order) {
    for (int i = 0; i < count; ++i)
      for (std::size_t c = 0; c < order.size(); ++c)
        EXPECT_EQ(array.GetComponent(i, static_cast<int>(c)), OpenFoamCase::value(i, order[c], 1))
            << array.GetName() << " " << i << " " << c;
  };
  for (const std::filesystem::path& path : {folder.path(), folder / "case.foam", folder / "system" / "controlDict"}) {
    const auto read = read_vtk_source(path);
    ASSERT_EQ(read->GetNumberOfCells(), OpenFoamCase::cells);
    ASSERT_EQ(read->GetNumberOfPoints(), 27);
    EXPECT_TRUE(Vector3d(read->GetPoint(26)).isApprox(Vector3d(2, 1, 4)));
    vtkCellData& data = *read->GetCellData();
    expect_order(*data.GetArray("U"), OpenFoamCase::cells, {0, 1, 2});
    expect_order(*data.GetArray("gradU"), OpenFoamCase::cells, {0, 1, 2, 3, 4, 5, 6, 7, 8});
    // VTK's xx yy zz xy yz xz among OpenFOAM's xx xy xz yy yz zz.
    expect_order(*data.GetArray("sigma"), OpenFoamCase::cells, {0, 3, 5, 1, 4, 2});
    // The components' names tell the order. The order of OpenFOAM's own files is refused.
    const ArrayChoice sigma{"sigma", true};
    const auto tensors = with_tensors(*read, sigma, Take::tensor, {});
    expect_order(*tensors->GetPointData()->GetArray("tensor"), 1, {0, 1, 2, 1, 3, 4, 2, 4, 5});
    EXPECT_THROW(with_tensors(*read, sigma, Take::tensor, TensorOrder::fsl), std::invalid_argument);
    // Points have the mean of their cells; the middle point has the mean of all cells.
    const auto gradients = with_tensors(*read, {"gradU", true}, Take::tensor, {});
    EXPECT_NEAR(gradients->GetPointData()->GetArray("tensor")->GetComponent(13, 3), 1000 + 35 + 3, 1e-3);
  }
}

TEST(VtkSourceTest, IncompleteOpenFoamCases) {
  const TemporaryFolder folder;
  const auto error = [&] { return read_error(folder); };
  EXPECT_THAT(error(), HasSubstr("controlDict is missing"));
  OpenFoamCase::write(folder);
  std::filesystem::rename(folder / "constant/polyMesh/owner", folder / "owner");
  EXPECT_THAT(error(), HasSubstr("owner: is missing"));
  std::filesystem::rename(folder / "owner", folder / "constant/polyMesh/owner");
  std::filesystem::remove_all(folder / "0");
  std::filesystem::remove_all(folder / "0.5");
  EXPECT_THAT(error(), HasSubstr("time"));
  std::filesystem::create_directories(folder / "processor0");
  std::filesystem::remove_all(folder / "constant");
  EXPECT_THAT(error(), HasSubstr("has no mesh"));
}

// Polyhedra as VTK 9.4 writes them: in four arrays of faces.
/// The faces of the second cube of a bar of two, which has the first one as a hexahedron.
const Ints connectivity{4, 5, 7, 6, 8, 10, 11, 9, 4, 8, 9, 5, 6, 7, 11, 10, 4, 6, 10, 8, 5, 9, 11, 7};
const Ints offsets{4, 8, 12, 16, 20, 24}, faces_of_cells{0, 1, 2, 3, 4, 5}, offsets_of_cells{0, 6};

/// A hexahedron, and a polyhedron.
Grid mixed_bar() {
  const Grid bars = bar(0, 2), mixed = Grid::New();
  mixed->SetPoints(bars->GetPoints());
  mixed->InsertNextCell(VTK_HEXAHEDRON, bars->GetCell(0)->GetPointIds());
  vtkNew<vtkIdList> stream;
  stream->InsertNextId(6);
  for (std::size_t i = 0; i < connectivity.size(); ++i) {
    if (i % 4 == 0) stream->InsertNextId(4);
    stream->InsertNextId(connectivity[i]);
  }
  mixed->InsertNextCell(VTK_POLYHEDRON, stream);
  return with_arrays(mixed);
}

void expect_linear(const std::filesystem::path& path, std::size_t voxels) {
  const TensorGrid grid = imported(path, array_settings("tensor", Take::tensor, 0.25)).grid;
  EXPECT_EQ(grid.active_voxels(), voxels);
  mesh_fixtures::for_each_voxel(grid, [](const Eigen::Vector3d& x, const Eigen::Matrix3d& tensor) {
    EXPECT_NEAR(tensor(1, 2), number(x.data(), 5), 1e-4) << x.transpose();
  });
}

TEST(Polyhedra, OfVtk94AreReadInAllFormsOfItsXml) {
  const TemporaryFolder folder;
  for (const Mode mode : {Mode::ascii, Mode::binary, Mode::raw_compressed, Mode::raw_plain}) {
    const Grid grid = mixed_bar();
    for (const auto& [name, values] : {std::pair("face_connectivity", connectivity),
                                       {"face_offsets", offsets},
                                       {"polyhedron_to_faces", faces_of_cells},
                                       {"polyhedron_offsets", offsets_of_cells}}) {
      vtkNew<vtkLongLongArray> array;
      array->SetName(name);
      for (const int value : values) array->InsertNextValue(value);
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
    EXPECT_THAT(read_error(folder / "a.vtu"), HasSubstr("its polyhedra name faces that are not there"));
  }
}

TEST(Polyhedra, OfVtkHdfAreReadOfEachPart) {
  const TemporaryFolder folder;
  {
    Hdf5Writer file(folder / "a.vtkhdf");
    const auto twice = [&](const std::string& name, const Ints& values) {
      Ints both = values;
      both.insert(both.end(), values.begin(), values.end());
      file.write("/VTKHDF/" + name, {both.size()}, both);
    };
    file.begin_vtk("UnstructuredGrid", {2, 5});
    twice("NumberOfPoints", {12});
    twice("NumberOfCells", {2});
    twice("NumberOfConnectivityIds", {16});
    twice("NumberOfFaces", {6});
    twice("NumberOfFaceConnectivityIds", {24});
    twice("NumberOfPolyhedronToFaceIds", {6});
    twice("Connectivity", {0, 4, 5, 1, 2, 6, 7, 3, 4, 5, 6, 7, 8, 9, 10, 11});
    twice("Offsets", {0, 8, 16});
    twice("Types", {12, 42});
    twice("FaceConnectivity", connectivity);
    twice("FaceOffsets", {0, 4, 8, 12, 16, 20, 24});
    twice("PolyhedronToFaces", faces_of_cells);
    twice("PolyhedronOffsets", {0, 0, 6});
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

/// A vector that tells positions and steps of time apart.
Vector3d velocity(const Vector3d& p, int step) {
  return (10 * p.y() + 100 * step + (Vector3d(1, 2, 3) * p.x() - Vector3d(2, 3, 4) * p.z()).array()).matrix();
}

void check(int error) { ASSERT_EQ(error, CG_OK) << cg_get_error(); }

/// `value(position)` at the 3 x 4 x 5 points of a zone, or at the centres of its cells.
template <class Value>
std::vector<double> zone_values(double first_x, bool of_cells, const Value& value) {
  const int nx = of_cells ? 2 : 3, ny = of_cells ? 3 : 4, nz = of_cells ? 4 : 5;
  const double shift = of_cells ? 0.5 : 0;
  std::vector<double> values;
  for (int i = 0; i < nx * ny * nz; ++i)
    values.push_back(
        value(Vector3d(first_x + i % nx + shift, 0.5 * (i / nx % ny + shift), 0.25 * (i / nx / ny + shift))));
  return values;
}

constexpr int base = 1;  ///< The number of a file's first and only one.

/// A solution with the velocity of a step at points or at cells.
void write_solution(int file, int zone, const std::string& name, double first_x, bool of_cells, int step) {
  int solution = 0, id = 0;
  check(
      cg_sol_write(file, base, zone, name.c_str(), of_cells ? CGNS_ENUMV(CellCenter) : CGNS_ENUMV(Vertex), &solution));
  for (int c = 0; c < 3; ++c) {
    const auto values = zone_values(first_x, of_cells, [&](const Vector3d& p) { return velocity(p, step)[c]; });
    const std::string field = std::string("Velocity") + "XYZ"[c];
    check(cg_field_write(file, base, zone, solution, CGNS_ENUMV(RealDouble), field.c_str(), values.data(), &id));
  }
}

void write_zone(int file, const std::string& name, double first_x, int steps) {
  const cgsize_t size[9] = {3, 4, 5, 2, 3, 4}, shape[] = {32, steps};
  int zone = 0, id = 0;
  check(cg_zone_write(file, base, name.c_str(), size, CGNS_ENUMV(Structured), &zone));
  for (int axis = 0; axis < 3; ++axis) {
    const auto values = zone_values(first_x, false, [&](const Vector3d& p) { return p[axis]; });
    const std::string coordinate = std::string("Coordinate") + "XYZ"[axis];
    check(cg_coord_write(file, base, zone, CGNS_ENUMV(RealDouble), coordinate.c_str(), values.data(), &id));
  }
  std::string solutions;
  for (int step = 0; step < steps; ++step) {
    const std::string of_step = "Solution" + std::to_string(step);
    solutions += of_step + std::string(32 - of_step.size(), ' ');
    write_solution(file, zone, of_step, first_x, false, step);
  }
  if (steps == 1) return write_solution(file, zone, "OfCells", first_x, true, 0);
  check(cg_ziter_write(file, base, zone, "ZoneIterativeData"));
  check(cg_goto(file, base, "Zone_t", zone, "ZoneIterativeData_t", 1, "end"));
  check(cg_array_write("FlowSolutionPointers", CGNS_ENUMV(Character), 2, shape, solutions.data()));
}

/// Two zones that meet at x = 2.
void write_cgns(const std::filesystem::path& path, int type, int steps) {
  int file = 0, number = 0;
  check(cg_set_file_type(type));
  check(cg_open(path.c_str(), CG_MODE_WRITE, &file));
  check(cg_base_write(file, "Base", 3, 3, &number));
  ASSERT_EQ(number, base);
  if (steps > 1) {
    const double times[] = {0.5, 1, 1.5};
    const cgsize_t count = steps;
    check(cg_biter_write(file, base, "BaseIterativeData", steps));
    check(cg_goto(file, base, "BaseIterativeData_t", 1, "end"));
    check(cg_array_write("TimeValues", CGNS_ENUMV(RealDouble), 1, &count, times));
  }
  write_zone(file, "left", 0, steps);
  write_zone(file, "right", 2, steps);
  check(cg_close(file));
}

/// Expects the velocity of a step at all points, or at the middles of all cells.
void expect_velocity(vtkDataSet& data, int step, bool of_cells = false) {
  EXPECT_EQ(data.GetNumberOfPoints(), 5 * 4 * 5);  // The points where zones meet are merged.
  EXPECT_EQ(data.GetNumberOfCells(), 4 * 3 * 4);
  vtkDataArray* const read =
      data.GetAttributes(of_cells ? vtkDataObject::CELL : vtkDataObject::POINT)->GetArray("Velocity");
  ASSERT_TRUE(read && read->GetNumberOfComponents() == 3);
  ASSERT_EQ(read->GetNumberOfTuples(), of_cells ? data.GetNumberOfCells() : data.GetNumberOfPoints());
  for (vtkIdType i = 0; i < read->GetNumberOfTuples(); ++i)
    EXPECT_EQ(Vector3d(read->GetTuple3(i)),
              velocity(of_cells ? mesh_fixtures::middle_of(*data.GetCell(i)) : Vector3d(data.GetPoint(i)), step))
        << (of_cells ? "cell " : "point ") << i;
}

TEST(Cgns, ZonesAreOneMeshInBothFormatsWithValuesAtPointsAndCells) {
  const TemporaryFolder folder;
  for (const int type : {CG_FILE_ADF, CG_FILE_HDF5}) {
    write_cgns(folder / "a.cgns", type, 1);
    EXPECT_EQ(time_steps(folder / "a.cgns"), 1);
    const auto read = read_vtk_source(folder / "a.cgns");
    for (const bool of_cells : {false, true}) expect_velocity(*read, 0, of_cells);
    std::filesystem::remove(folder / "a.cgns");
  }
}

TEST(Cgns, HasStepsOfTime) {
  const TemporaryFolder folder;
  write_cgns(folder / "a.cgns", CG_FILE_HDF5, 3);
  EXPECT_EQ(time_steps(folder / "a.cgns"), 3);
  expect_velocity(*read_vtk_source(folder / "a.cgns", 0), 0);
  expect_velocity(*read_vtk_source(folder / "a.cgns", 1), 1);
  expect_velocity(*read_vtk_source(folder / "a.cgns"), 2);
  EXPECT_THROW(read_vtk_source(folder / "a.cgns", 3), std::invalid_argument);
}

TEST(Cgns, DamageIsOneLine) {
  const TemporaryFolder folder;
  write_bytes(folder / "none.cgns", "no CGNS");
  EXPECT_THAT(read_error(folder / "none.cgns"), HasSubstr("none.cgns"));
  write_cgns(folder / "a.cgns", CG_FILE_HDF5, 1);
  std::filesystem::resize_file(folder / "a.cgns", std::filesystem::file_size(folder / "a.cgns") / 2);
  EXPECT_THAT(read_error(folder / "a.cgns"), HasSubstr("a.cgns"));
}

}  // namespace
}  // namespace tensorray
