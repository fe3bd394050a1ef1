#include "tools/import/vtk_source.h"

#include <cmath>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <vtkAppendFilter.h>
#include <vtkCellData.h>
#include <vtkDataSetWriter.h>
#include <vtkDoubleArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkRectilinearGrid.h>
#include <vtkStructuredGrid.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLDataSetWriter.h>
#include <vtkXMLPolyDataWriter.h>

#include "tests/import/mesh_files.h"
#include "tests/import/openfoam_case.h"
#include "tools/import/mesh_tensors.h"

namespace tensorray {
namespace {

/// Component c at a place.
double number(const double* x, int c) { return 3 * x[0] - 5 * x[1] + 7 * x[2] + c; }

/// Point array "tensor" of nine and cell array "rate" of three components.
template <typename Set>
vtkSmartPointer<Set> with_arrays(vtkSmartPointer<Set> set) {
  vtkNew<vtkDoubleArray> tensor, rate;
  tensor->SetName("tensor");
  tensor->SetNumberOfComponents(9);
  tensor->SetNumberOfTuples(set->GetNumberOfPoints());
  for (vtkIdType i = 0; i < set->GetNumberOfPoints(); ++i) {
    for (int c = 0; c < 9; ++c) tensor->SetComponent(i, c, number(set->GetPoint(i), c));
  }
  rate->SetName("rate");
  rate->SetNumberOfComponents(3);
  rate->SetNumberOfTuples(set->GetNumberOfCells());
  for (vtkIdType i = 0; i < set->GetNumberOfCells(); ++i) {
    for (int c = 0; c < 3; ++c) rate->SetComponent(i, c, static_cast<double>(i) + 0.25 * c);
  }
  set->GetPointData()->AddArray(tensor);
  set->GetCellData()->AddArray(rate);
  return set;
}

vtkSmartPointer<vtkImageData> image() {
  auto set = vtkSmartPointer<vtkImageData>::New();
  set->SetDimensions(5, 4, 3);
  set->SetOrigin(1, 2, 3);
  set->SetSpacing(0.5, 1, 2);
  return with_arrays(set);
}

vtkSmartPointer<vtkRectilinearGrid> rectilinear() {
  auto set = vtkSmartPointer<vtkRectilinearGrid>::New();
  vtkNew<vtkDoubleArray> x, y, z;
  for (const double value : {0.0, 1.0, 4.0}) x->InsertNextValue(value);
  for (const double value : {-1.0, 0.5}) y->InsertNextValue(value);
  for (const double value : {2.0, 3.0, 9.0, 10.0}) z->InsertNextValue(value);
  set->SetDimensions(3, 2, 4);
  set->SetXCoordinates(x);
  set->SetYCoordinates(y);
  set->SetZCoordinates(z);
  return with_arrays(set);
}

vtkSmartPointer<vtkStructuredGrid> structured() {
  auto set = vtkSmartPointer<vtkStructuredGrid>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (int i = 0; i < 4 * 3 * 2; ++i)
    points->InsertNextPoint(i % 4 + 0.1 * (i / 12), i / 4 % 3, i / 12 + 0.2 * (i % 4));
  set->SetDimensions(4, 3, 2);
  set->SetPoints(points);
  return with_arrays(set);
}

/// A bar of unit cubes along x, from `first`.
vtkSmartPointer<vtkUnstructuredGrid> bar(int first, int cubes) {
  auto set = vtkSmartPointer<vtkUnstructuredGrid>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (int i = 0; i <= cubes; ++i) {
    for (int corner = 0; corner < 4; ++corner) points->InsertNextPoint(first + i, corner % 2, corner / 2);
  }
  set->SetPoints(points);
  for (vtkIdType i = 0; i < cubes; ++i) {
    const vtkIdType p = 4 * i, corners[8] = {p, p + 4, p + 5, p + 1, p + 2, p + 6, p + 7, p + 3};
    set->InsertNextCell(VTK_HEXAHEDRON, 8, corners);
  }
  return with_arrays(set);
}

enum class Mode { ascii, binary, raw_compressed, raw_plain };

void write_xml(vtkDataSet& set, const std::filesystem::path& path, Mode mode = Mode::raw_compressed) {
  vtkNew<vtkXMLDataSetWriter> writer;
  writer->SetInputData(&set);
  writer->SetFileName(path.c_str());
  writer->SetDataMode(mode == Mode::ascii    ? vtkXMLWriter::Ascii
                      : mode == Mode::binary ? vtkXMLWriter::Binary
                                             : vtkXMLWriter::Appended);
  writer->SetEncodeAppendedData(false);
  if (mode == Mode::raw_plain) writer->SetCompressorTypeToNone();
  ASSERT_EQ(writer->Write(), 1);
}

void write_legacy(vtkDataSet& set, const std::filesystem::path& path, bool binary) {
  vtkNew<vtkDataSetWriter> writer;
  writer->SetInputData(&set);
  writer->SetFileName(path.c_str());
  binary ? writer->SetFileTypeToBinary() : writer->SetFileTypeToASCII();
  ASSERT_EQ(writer->Write(), 1);
}

void expect_same(vtkDataSet& read, vtkDataSet& written, double tolerance) {
  ASSERT_EQ(read.GetNumberOfPoints(), written.GetNumberOfPoints());
  ASSERT_EQ(read.GetNumberOfCells(), written.GetNumberOfCells());
  vtkDataArray* const tensor = read.GetPointData()->GetArray("tensor");
  vtkDataArray* const rate = read.GetCellData()->GetArray("rate");
  ASSERT_TRUE(tensor && rate);
  for (vtkIdType i = 0; i < read.GetNumberOfPoints(); ++i) {
    const Eigen::Vector3d x(read.GetPoint(i)), expected(written.GetPoint(i));
    EXPECT_LT((x - expected).norm(), tolerance);
    for (int c = 0; c < 9; ++c) EXPECT_NEAR(tensor->GetComponent(i, c), number(expected.data(), c), tolerance);
  }
  for (vtkIdType i = 0; i < read.GetNumberOfCells(); ++i) {
    EXPECT_NEAR(rate->GetComponent(i, 2), static_cast<double>(i) + 0.5, tolerance);
  }
}

std::vector<std::pair<std::string, vtkSmartPointer<vtkDataSet>>> data_sets() {
  return {{".vti", image()}, {".vtr", rectilinear()}, {".vts", structured()}, {".vtu", bar(0, 3)}};
}

TEST(VtkSourceTest, XmlFilesOfEveryEncoding) {
  const TemporaryFolder folder;
  for (const auto& [ending, written] : data_sets()) {
    for (const Mode mode : {Mode::ascii, Mode::binary, Mode::raw_compressed, Mode::raw_plain}) {
      SCOPED_TRACE(ending);
      write_xml(*written, folder / ("file" + ending), mode);
      const auto read = read_vtk_source(folder / ("file" + ending));
      EXPECT_STREQ(read->GetClassName(), written->GetClassName());
      expect_same(*read, *written, mode == Mode::ascii ? 1e-9 : 0x1p-1000);
    }
  }
}

TEST(VtkSourceTest, LegacyFiles) {
  const TemporaryFolder folder;
  for (const auto& [ending, written] : data_sets()) {
    for (const bool binary : {false, true}) {
      SCOPED_TRACE(ending);
      write_legacy(*written, folder / "file.vtk", binary);
      const auto read = read_vtk_source(folder / "file.vtk");
      EXPECT_TRUE(read->IsA(written->GetClassName())) << read->GetClassName();
      expect_same(*read, *written, binary ? 0x1p-1000 : 1e-5);  // VTK writes ASCII with six or more digits
    }
  }
}

std::string pieces_text(const std::string& kind, const std::string& whole, const std::string& pieces) {
  return "<VTKFile type=\"" + kind + "\" version=\"0.1\" byte_order=\"LittleEndian\">\n<" + kind +
         " GhostLevel=\"0\" " + whole +
         ">\n<PPointData><PDataArray type=\"Float64\" Name=\"tensor\" NumberOfComponents=\"9\"/></PPointData>\n" +
         "<PCellData><PDataArray type=\"Float64\" Name=\"rate\" NumberOfComponents=\"3\"/></PCellData>\n" +
         "<PPoints><PDataArray type=\"Float64\" NumberOfComponents=\"3\"/></PPoints>\n" + pieces + "</" + kind +
         ">\n</VTKFile>\n";
}

TEST(VtkSourceTest, UnstructuredPiecesAreMergedAndGhostCellsRemoved) {
  const TemporaryFolder folder;
  const auto first = bar(0, 3), second = bar(2, 3);  // they share the cube from 2 to 3, which is the first's
  second->AllocateCellGhostArray()->SetValue(0, vtkDataSetAttributes::DUPLICATECELL);
  second->AllocatePointGhostArray()->SetValue(5, vtkDataSetAttributes::DUPLICATEPOINT);
  write_xml(*first, folder / "p0.vtu");
  write_xml(*second, folder / "p1.vtu");
  write_bytes(folder / "all.pvtu",
              pieces_text("PUnstructuredGrid", "", "<Piece Source=\"p0.vtu\"/><Piece Source=\"p1.vtu\"/>\n"));
  const auto read = read_vtk_source(folder / "all.pvtu");
  EXPECT_EQ(read->GetNumberOfCells(), 5);
  EXPECT_EQ(read->GetNumberOfPoints(), 24);
  EXPECT_FALSE(read->HasAnyGhostPoints());
  for (vtkIdType i = 0; i < read->GetNumberOfPoints(); ++i) {
    EXPECT_EQ(read->GetPointData()->GetArray("tensor")->GetComponent(i, 4), number(read->GetPoint(i), 4));
  }

  std::filesystem::remove(folder / "p1.vtu");
  EXPECT_NE(error_of([&] { read_vtk_source(folder / "all.pvtu"); }).find("p1.vtu is missing"), std::string::npos);
  write_xml(*image(), folder / "image.vti");
  std::filesystem::rename(folder / "image.vti", folder / "p1.vtu");
  EXPECT_NE(error_of([&] { read_vtk_source(folder / "all.pvtu"); }).find("p1.vtu: "), std::string::npos);
}

TEST(VtkSourceTest, HiddenPointsStayMarked) {
  const TemporaryFolder folder;
  const auto written = structured();
  written->BlankPoint(7);
  write_xml(*written, folder / "file.vts");
  const vtkSmartPointer<vtkStructuredGrid> read =
      vtkStructuredGrid::SafeDownCast(read_vtk_source(folder / "file.vts").Get());
  ASSERT_TRUE(read);
  for (vtkIdType i = 0; i < read->GetNumberOfPoints(); ++i) EXPECT_EQ(read->IsPointVisible(i) == 0, i == 7);
}

TEST(VtkSourceTest, ImagePiecesAreOneImage) {
  const std::filesystem::path path = data_file("pv_tensors/tensors.pvti");
  SKIP_WITHOUT(path);
  const vtkSmartPointer<vtkImageData> read = vtkImageData::SafeDownCast(read_vtk_source(path).Get());
  ASSERT_TRUE(read);
  vtkDataArray* const gradient = read->GetPointData()->GetArray("grad-ue");
  ASSERT_TRUE(gradient);
  const Lattice lattice = lattice_of(read, gradient, false);
  EXPECT_EQ(lattice.size, Eigen::Vector3i(64, 1, 64));
  EXPECT_EQ(lattice.components, 9);
  EXPECT_TRUE((lattice.to_world * Eigen::Vector3d::Zero()).isApprox(Eigen::Vector3d(7206, 0, 981)));
  double peak = 0, asymmetry = 0;
  for (vtkIdType i = 0; i < 64 * 64; ++i) {
    Eigen::Matrix3d t;
    gradient->GetTuple(i, t.data());
    peak = std::max(peak, t.cwiseAbs().maxCoeff());
    asymmetry = std::max(asymmetry, (t - t.transpose()).norm());
  }
  EXPECT_NEAR(peak, 1.4e-3, 0.1e-3);
  EXPECT_GT(asymmetry, 1e-4);

  // Each piece stands where the whole says: a point of the last one.
  const vtkSmartPointer<vtkImageData> piece =
      vtkImageData::SafeDownCast(read_vtk_source(data_file("pv_tensors/tensors_3.vti")).Get());
  int from[3] = {310, 0, 140};
  for (int c = 0; c < 9; ++c) {
    EXPECT_EQ(gradient->GetComponent(read->ComputePointId(from), c),
              piece->GetPointData()->GetArray("grad-ue")->GetComponent(piece->ComputePointId(from), c));
  }
}

TEST(VtkSourceTest, NotchStress) {
  const std::filesystem::path path = data_file("notch_stress/notch_stress.vtk");
  SKIP_WITHOUT(path);
  const auto read = read_vtk_source(path), fixed = read_vtk_source(data_file("notch_stress/notch_stress_fixed.vtk"));
  ASSERT_EQ(read->GetNumberOfPoints(), 12717);
  EXPECT_EQ(fixed->GetNumberOfPoints(), 3537);
  vtkDataArray* const stress = read->GetPointData()->GetArray("Nodal Stress");
  ASSERT_TRUE(stress);
  EXPECT_EQ(stress->GetNumberOfComponents(), 6);
  int zero = 0, nan = 0;
  for (vtkIdType i = 0; i < 12717; ++i) {
    Eigen::Matrix<double, 6, 1> s;
    stress->GetTuple(i, s.data());
    zero += s.isZero(0);
    bool is_nan = false;
    for (int a = 0; a < read->GetPointData()->GetNumberOfArrays(); ++a) {
      vtkDataArray* const array = read->GetPointData()->GetArray(a);
      is_nan = is_nan || (array->GetNumberOfComponents() == 1 && std::isnan(array->GetComponent(i, 0)));
    }
    nan += is_nan;
  }
  EXPECT_EQ(zero, 9180);
  EXPECT_EQ(nan, 9180);
}

TEST(VtkSourceTest, Carotid) {
  const std::filesystem::path path = data_file("carotid/carotid.vtk");
  SKIP_WITHOUT(path);
  const vtkSmartPointer<vtkImageData> read = vtkImageData::SafeDownCast(read_vtk_source(path).Get());
  ASSERT_TRUE(read);
  EXPECT_EQ(Eigen::Vector3i(read->GetDimensions()), Eigen::Vector3i(76, 49, 45));
  EXPECT_EQ(Eigen::Vector3d(read->GetOrigin()), Eigen::Vector3d(100, 80, 1));
  EXPECT_EQ(read->GetPointData()->GetArray("vectors")->GetNumberOfComponents(), 3);
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

TEST(VtkSourceTest, EightTensors) {
  const std::filesystem::path path = data_file("vtk_tensors/tensors.vtk");
  SKIP_WITHOUT(path);
  const auto read = read_vtk_source(path);
  EXPECT_EQ(read->GetNumberOfCells(), 1);
  EXPECT_EQ(read->GetCellType(0), VTK_VOXEL);
  vtkDataArray* const tensors = read->GetPointData()->GetArray("tensors1");
  ASSERT_TRUE(tensors);
  ASSERT_EQ(tensors->GetNumberOfTuples(), 8);
  Eigen::Matrix3d first, second, last;
  tensors->GetTuple(0, first.data());
  tensors->GetTuple(1, second.data());
  tensors->GetTuple(7, last.data());
  EXPECT_EQ(first, Eigen::Matrix3d::Identity());
  EXPECT_EQ(second, Eigen::Matrix3d(Eigen::Vector3d(-2, -2, 3).asDiagonal()));
  EXPECT_EQ(last, Eigen::Matrix3d::Zero());
  EXPECT_TRUE(read->GetPointData()->HasArray("other_scalars"));
}

TEST(VtkSourceTest, BrainWithNanBackground) {
  const std::filesystem::path path = data_file("nan/brain_nan_background.vti");
  SKIP_WITHOUT(path);
  const vtkSmartPointer<vtkImageData> read = vtkImageData::SafeDownCast(read_vtk_source(path).Get());
  ASSERT_TRUE(read);
  vtkDataArray* const tensor = read->GetPointData()->GetArray("diffusion_tensor");
  ASSERT_TRUE(tensor);
  int nan = 0;
  for (vtkIdType i = 0; i < tensor->GetNumberOfTuples(); ++i) nan += std::isnan(tensor->GetComponent(i, 0));
  EXPECT_EQ(nan, 367276);
}

TEST(VtkSourceTest, PointLoad) {
  const std::filesystem::path path = data_file("pointload/pointload_32.vti");
  SKIP_WITHOUT(path);
  const vtkSmartPointer<vtkImageData> read = vtkImageData::SafeDownCast(read_vtk_source(path).Get());
  ASSERT_TRUE(read);
  const Lattice lattice = lattice_of(read, read->GetPointData()->GetArray("stress"), false);
  EXPECT_EQ(lattice.size, Eigen::Vector3i(32, 32, 32));
  EXPECT_TRUE((lattice.to_world * Eigen::Vector3d::Zero()).isApprox(Eigen::Vector3d(-10, -10, -10)));
  EXPECT_TRUE((lattice.to_world * Eigen::Vector3d(31, 31, 31)).isApprox(Eigen::Vector3d(10, 10, 10)));
}

TEST(VtkSourceTest, OpenFoamCase) {
  const TemporaryFolder folder;
  OpenFoamCase::write(folder);
  write_bytes(folder / "case.foam", "");
  for (const std::filesystem::path& path :
       {std::filesystem::path(folder), folder / "case.foam", folder / "system" / "controlDict"}) {
    const auto read = read_vtk_source(path);
    ASSERT_EQ(read->GetNumberOfCells(), OpenFoamCase::cells);
    ASSERT_EQ(read->GetNumberOfPoints(), 27);
    EXPECT_TRUE(Eigen::Vector3d(read->GetPoint(26)).isApprox(Eigen::Vector3d(2, 1, 4)));
    const int symmetric[6] = {0, 3, 5, 1, 4, 2};  // VTK's xx yy zz xy yz xz among OpenFOAM's xx xy xz yy yz zz
    for (int cell = 0; cell < OpenFoamCase::cells; ++cell) {
      vtkCellData& data = *read->GetCellData();
      for (int c = 0; c < 9; ++c)
        EXPECT_EQ(data.GetArray("gradU")->GetComponent(cell, c), OpenFoamCase::value(cell, c, 1));
      for (int c = 0; c < 6; ++c) {
        EXPECT_EQ(data.GetArray("sigma")->GetComponent(cell, c), OpenFoamCase::value(cell, symmetric[c], 1));
      }
      for (int c = 0; c < 3; ++c) EXPECT_EQ(data.GetArray("U")->GetComponent(cell, c), OpenFoamCase::value(cell, c, 1));
    }
    // The order is known without being given, and that of OpenFOAM's own files is refused.
    const ArrayChoice sigma{"sigma", true};
    const auto tensors = with_tensors(*read, sigma, Take::tensor, {});
    const double* const corner =
        vtkDoubleArray::SafeDownCast(tensors->GetPointData()->GetArray("tensor"))->GetPointer(0);
    for (int c = 0; c < 9; ++c) {
      const int expected[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
      EXPECT_EQ(corner[c], OpenFoamCase::value(0, expected[c], 1)) << c;
    }
    EXPECT_NO_THROW(with_tensors(*read, {"sigma", false}, Take::tensor, {}));
    EXPECT_THROW(with_tensors(*read, sigma, Take::tensor, TensorOrder::fsl), std::invalid_argument);
    // Points have the mean of their cells: the middle one that of all.
    EXPECT_NEAR(read->GetPointData()->GetArray("gradU")->GetComponent(13, 3), 1000 + 35 + 3, 1e-3);
  }
}

TEST(VtkSourceTest, IncompleteOpenFoamCases) {
  const TemporaryFolder folder;
  const auto error = [&] { return error_of([&] { read_vtk_source(folder); }); };
  EXPECT_NE(error().find("controlDict is missing"), std::string::npos);
  OpenFoamCase::write(folder);
  std::filesystem::rename(folder / "constant/polyMesh/owner", folder / "owner");
  EXPECT_NE(error().find("owner: is missing"), std::string::npos);
  std::filesystem::rename(folder / "owner", folder / "constant/polyMesh/owner");
  std::filesystem::remove_all(folder / "0");
  std::filesystem::remove_all(folder / "0.5");
  EXPECT_NE(error().find("time"), std::string::npos);
  std::filesystem::create_directories(folder / "processor0");
  std::filesystem::remove_all(folder / "constant");
  EXPECT_NE(error().find("reconstructPar"), std::string::npos);
}

TEST(VtkSourceTest, FilesThatAreNotWhatTheirEndingSays) {
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
  write_bytes(folder / "unknown.dat", "of no kind");
  for (const char* supported : {"ExodusII", ".nrrd", ".nii", ".npy", "PLOT3D needs two files, the grid and its q"})
    EXPECT_NE(error("unknown.dat").find(supported), std::string::npos) << error("unknown.dat");
  EXPECT_EQ(read_vtk_source(folder / "grid.xml")->GetNumberOfPoints(), 24);
  for (const char* name : {"b.vtk", "b.vti", "b.vts", "b.pvtu", "b.ex2", "b.dat"}) {
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

std::string tetrahedron(const std::string& points, const std::string& cells, const std::string& type = "10") {
  return "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n" + points + "\nCELLS 1 " +
         cells + "\nCELL_TYPES 1\n" + type + "\nPOINT_DATA 4\nSCALARS s double\nLOOKUP_TABLE default\n1 2 3 4\n";
}

TEST(VtkSourceTest, CellsOfPointsThatAreNotThere) {
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

  const std::string faces = "4 3 0 1 2 3 0 3 1 3 1 3 2 3 0 2 ";  // of a polyhedron
  EXPECT_EQ(error("18\n17 " + faces + "3", "42"), "");
  EXPECT_NE(error("18\n17 " + faces + "9", "42").find("a.vtk: "), std::string::npos);
}

/// Faces that name other points than their cell, as only XML files can have them.
TEST(VtkSourceTest, FacesOfPointsThatAreNotThere) {
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
  // Wrong counts in the stream are another matter: VTK itself reads on beyond its end.
  std::string damaged = bytes;
  damaged[stream + 8] = '9';
  write_bytes(folder / "a.vtu", damaged);
  EXPECT_NE(error_of([&] { read_vtk_source(folder / "a.vtu"); }).find("a.vtu: "), std::string::npos);
}

TEST(VtkSourceTest, CoordinatesThatAreNotFiniteOrTooLarge) {
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

TEST(VtkSourceTest, FewerPointsThanDimensions) {
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

/// An image in an XML file with those extents as its pieces, each with a number per point.
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

TEST(VtkSourceTest, PiecesFillTheExtent) {
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

TEST(VtkSourceTest, PiecesInOtherFilesFillTheExtent) {
  const TemporaryFolder folder;
  const std::string whole = "WholeExtent=\"0 4 0 3 0 2\" Origin=\"0 0 0\" Spacing=\"1 1 1\"";
  const std::string first = "<Piece Extent=\"0 3 0 3 0 2\" Source=\"p0.vti\"/>\n",
                    second = "<Piece Extent=\"2 4 0 3 0 2\" Source=\"p1.vti\"/>\n";
  write_bytes(folder / "p0.vti", image_text("0 4 0 3 0 2", {"0 3 0 3 0 2"}));  // with the extent of the whole
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

TEST(VtkSourceTest, TruncatedXmlFiles) {
  const TemporaryFolder folder;
  for (const auto& [ending, written] : data_sets()) {
    write_xml(*written, folder / "whole.xml");
    const std::string bytes = bytes_of(folder / "whole.xml");
    for (const double part : {0.01, 0.1, 0.5, 0.9, 0.99}) {
      write_bytes(folder / ("cut" + ending),
                  bytes.substr(0, static_cast<std::size_t>(part * static_cast<double>(bytes.size()))));
      EXPECT_FALSE(error_of([&] { read_vtk_source(folder / ("cut" + ending)); }).empty()) << ending << part;
    }
  }
}

TEST(VtkSourceTest, TruncatedLegacyFiles) {
  const TemporaryFolder folder;
  for (const auto& [ending, written] : data_sets()) {
    for (const bool binary : {false, true}) {
      written->GetCellData()->Initialize();  // so that the file ends with the tensors
      write_legacy(*written, folder / "whole.vtk", binary);
      const std::string bytes = bytes_of(folder / "whole.vtk");
      // Within the tensors: a file that ends between two arrays is a whole one of fewer arrays.
      for (const std::size_t cut : {20, 100, 300}) {
        write_bytes(folder / "cut.vtk", bytes.substr(0, bytes.size() - cut));
        EXPECT_FALSE(error_of([&] { read_vtk_source(folder / "cut.vtk"); }).empty()) << ending << binary << cut;
      }
    }
  }
}

TEST(VtkSourceTest, TruncatedExodusFiles) {
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

/// VTK's own complaints, which it would have printed.
TEST(VtkSourceTest, DamageInsideIsThrownAndNotPrinted) {
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
