#pragma once
/// Small data sets of every kind with a point array "tensor" and a cell array "rate", and files that contain them.

#include <optional>
#include <utility>

#include <vtkDataSetWriter.h>
#include <vtkImageData.h>
#include <vtkRectilinearGrid.h>
#include <vtkXMLDataSetWriter.h>

#include "tests/import/mesh_files.h"
#include "tests/import/mesh_fixtures.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {

/// The error of reading a file at a step, or at the last complete one; empty if it is read.
inline std::string read_error(const std::filesystem::path& path, std::optional<int> step = std::nullopt) {
  return error_in_child(path, [&] { read_vtk_source(path, step); });
}

/// A .vtm file of these files.
inline std::string blocks_of(const std::vector<std::string>& files) {
  std::string text = "<VTKFile type=\"vtkMultiBlockDataSet\"><vtkMultiBlockDataSet>";
  for (const std::string& file : files) text += "<DataSet file=\"" + file + "\"/>";
  return text + "</vtkMultiBlockDataSet></VTKFile>\n";
}

inline double number(const double* x, int c) { return 3 * x[0] - 5 * x[1] + 7 * x[2] + c; }

/// Adds the point array "tensor" with nine components and the cell array "rate" with three.
template <typename Set>
inline vtkSmartPointer<Set> with_arrays(vtkSmartPointer<Set> set) {
  using Numbers = Eigen::Matrix<double, 9, 1>;
  mesh_fixtures::add_array<9>(*set, "tensor", [](const Vector3d& x) {
    return Numbers(Numbers::LinSpaced(0, 8).array() + number(x.data(), 0));
  });
  mesh_fixtures::add_cell_array<3>(
      *set, "rate", [](vtkIdType i) { return Vector3d(Vector3d(0, 0.25, 0.5).array() + static_cast<double>(i)); });
  return set;
}

inline vtkSmartPointer<vtkImageData> image() {
  auto set = vtkSmartPointer<vtkImageData>::New();
  set->SetDimensions(5, 4, 3);
  set->SetOrigin(1, 2, 3);
  set->SetSpacing(0.5, 1, 2);
  return with_arrays(set);
}

inline vtkSmartPointer<vtkRectilinearGrid> rectilinear_grid(const std::vector<double>& x, const std::vector<double>& y,
                                                            const std::vector<double>& z) {
  const auto coordinates = [](const std::vector<double>& values) {
    auto array = vtkSmartPointer<vtkDoubleArray>::New();
    for (const double value : values) array->InsertNextValue(value);
    return array;
  };
  auto set = vtkSmartPointer<vtkRectilinearGrid>::New();
  set->SetDimensions(static_cast<int>(x.size()), static_cast<int>(y.size()), static_cast<int>(z.size()));
  set->SetXCoordinates(coordinates(x));
  set->SetYCoordinates(coordinates(y));
  set->SetZCoordinates(coordinates(z));
  return set;
}

inline vtkSmartPointer<vtkRectilinearGrid> rectilinear() {
  return with_arrays(rectilinear_grid({0, 1, 4}, {-1, 0.5}, {2, 3, 9, 10}));
}

inline vtkSmartPointer<vtkStructuredGrid> structured() {
  return with_arrays(mesh_fixtures::curvilinear(
      {4, 3, 2}, [](const Vector3d& p) { return Vector3d(3 * p.x() + 0.1 * p.z(), 2 * p.y(), p.z() + 0.6 * p.x()); }));
}

/// A bar of unit cubes along x that begins at `first`.
inline vtkSmartPointer<vtkUnstructuredGrid> bar(int first, int cubes) {
  auto set = vtkSmartPointer<vtkUnstructuredGrid>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (int i = 0; i <= cubes; ++i)
    for (int corner = 0; corner < 4; ++corner) points->InsertNextPoint(first + i, corner % 2, corner / 2);
  set->SetPoints(points);
  for (vtkIdType i = 0; i < cubes; ++i) {
    const vtkIdType p = 4 * i, corners[8] = {p, p + 4, p + 5, p + 1, p + 2, p + 6, p + 7, p + 3};
    set->InsertNextCell(VTK_HEXAHEDRON, 8, corners);
  }
  return with_arrays(set);
}

enum class Mode { ascii, binary, raw_compressed, raw_plain };

inline void write_xml(vtkDataSet& set, const std::filesystem::path& path, Mode mode = Mode::raw_compressed) {
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

inline void write_legacy(vtkDataSet& set, const std::filesystem::path& path, bool binary) {
  vtkNew<vtkDataSetWriter> writer;
  writer->SetInputData(&set);
  writer->SetFileName(path.c_str());
  binary ? writer->SetFileTypeToBinary() : writer->SetFileTypeToASCII();
  ASSERT_EQ(writer->Write(), 1);
}

inline void expect_same(vtkDataSet& read, vtkDataSet& written, double tolerance) {
  ASSERT_EQ(read.GetNumberOfPoints(), written.GetNumberOfPoints());
  ASSERT_EQ(read.GetNumberOfCells(), written.GetNumberOfCells());
  vtkDataArray* const tensor = read.GetPointData()->GetArray("tensor");
  vtkDataArray* const rate = read.GetCellData()->GetArray("rate");
  ASSERT_TRUE(tensor && rate);
  for (vtkIdType i = 0; i < read.GetNumberOfPoints(); ++i) {
    const Vector3d x(read.GetPoint(i)), expected(written.GetPoint(i));
    EXPECT_LT((x - expected).norm(), tolerance);
    for (int c = 0; c < 9; ++c) EXPECT_NEAR(tensor->GetComponent(i, c), number(expected.data(), c), tolerance);
  }
  for (vtkIdType i = 0; i < read.GetNumberOfCells(); ++i)
    EXPECT_NEAR(rate->GetComponent(i, 2), static_cast<double>(i) + 0.5, tolerance);
}

inline std::vector<std::pair<std::string, vtkSmartPointer<vtkDataSet>>> data_sets() {
  return {{".vti", image()}, {".vtr", rectilinear()}, {".vts", structured()}, {".vtu", bar(0, 3)}};
}

}  // namespace tensorray
