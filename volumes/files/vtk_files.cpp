#include "volumes/files/vtk_files.h"

#include <algorithm>
#include <fstream>
#include <numeric>
#include <stdexcept>
#include <system_error>

#include <vtkAOSDataArrayTemplate.h>
#include <vtkCallbackCommand.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCommand.h>
#include <vtkDoubleArray.h>
#include <vtkErrorCode.h>
#include <vtkExecutive.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkTypeInt64Array.h>
#include <vtkUnsignedCharArray.h>
#include <vtkXMLPolyDataWriter.h>

namespace tensorray {
namespace {

vtkSmartPointer<vtkAOSDataArrayTemplate<double>> new_array(double) { return vtkSmartPointer<vtkDoubleArray>::New(); }
vtkSmartPointer<vtkAOSDataArrayTemplate<float>> new_array(float) { return vtkSmartPointer<vtkFloatArray>::New(); }
vtkSmartPointer<vtkAOSDataArrayTemplate<int>> new_array(std::int32_t) { return vtkSmartPointer<vtkIntArray>::New(); }
vtkSmartPointer<vtkAOSDataArrayTemplate<unsigned char>> new_array(std::uint8_t) {
  return vtkSmartPointer<vtkUnsignedCharArray>::New();
}

/// A VTK array over memory that the caller keeps; VTK only reads it.
template <class Number>
vtkSmartPointer<vtkDataArray> view_of(const std::string& name, const Number* values, int components,
                                      std::size_t count) {
  const auto array = new_array(Number());
  array->SetName(name.c_str());
  array->SetNumberOfComponents(components);
  array->SetArray(const_cast<Number*>(values), static_cast<vtkIdType>(count) * components, /*save=*/1);
  return array;
}

vtkSmartPointer<vtkDataArray> view_of(const std::string& name, const DataArray& data) {
  return std::visit(
      [&](const auto& values) {
        const auto components = static_cast<std::size_t>(data.components);
        return view_of(name, values.data(), data.components, values.size() / components);
      },
      data.values);
}

template <class Number>
const Number* numbers(const std::vector<Eigen::Matrix<Number, 3, 1>>& vectors) {
  static_assert(sizeof(Eigen::Matrix<Number, 3, 1>) == 3 * sizeof(Number), "vectors are contiguous");
  return reinterpret_cast<const Number*>(vectors.data());
}

void add_texts(vtkPolyData& polydata, const std::string& name, const std::vector<std::string>& lines) {
  vtkNew<vtkStringArray> text;
  text->SetName(name.c_str());
  for (const std::string& line : lines) text->InsertNextValue(line);
  polydata.GetFieldData()->AddArray(text);
}

vtkNew<vtkPolyData> polydata_of(const PointCloud& cloud) {
  const std::size_t count = cloud.positions.size();
  vtkNew<vtkPolyData> polydata;
  vtkNew<vtkPoints> points;
  points->SetData(view_of("Points", numbers(cloud.positions), 3, count));
  polydata->SetPoints(points);

  vtkNew<vtkCellArray> vertices;
  vertices->AllocateExact(static_cast<vtkIdType>(count), static_cast<vtkIdType>(count));
  for (std::size_t i = 0; i < count; ++i) {
    const vtkIdType point = static_cast<vtkIdType>(i);
    vertices->InsertNextCell(1, &point);
  }
  polydata->SetVerts(vertices);

  for (const auto& [name, values] : cloud.scalars)
    polydata->GetPointData()->AddArray(view_of(name, values.data(), 1, count));
  for (const auto& [name, values] : cloud.vectors)
    polydata->GetPointData()->AddArray(view_of(name, numbers(values), 3, count));
  for (const auto& [key, value] : cloud.metadata) add_texts(*polydata, key, {value});
  return polydata;
}

vtkNew<vtkPolyData> polydata_of(const PolylineData& lines) {
  vtkNew<vtkPolyData> polydata;
  vtkNew<vtkPoints> points;
  points->SetData(view_of("Points", numbers(lines.points), 3, lines.points.size()));
  polydata->SetPoints(points);

  vtkNew<vtkTypeInt64Array> ends, corners;
  ends->SetNumberOfValues(static_cast<vtkIdType>(lines.line_ends.size() + 1));
  ends->SetValue(0, 0);
  std::transform(lines.line_ends.begin(), lines.line_ends.end(), ends->GetPointer(1),
                 [](std::size_t end) { return static_cast<vtkTypeInt64>(end); });
  corners->SetNumberOfValues(static_cast<vtkIdType>(lines.points.size()));
  std::iota(corners->GetPointer(0), corners->GetPointer(0) + lines.points.size(), vtkTypeInt64{0});
  vtkNew<vtkCellArray> cells;
  cells->SetData(ends, corners);
  polydata->SetLines(cells);

  for (const auto& [name, data] : lines.point_data) polydata->GetPointData()->AddArray(view_of(name, data));
  for (const auto& [name, data] : lines.line_data) polydata->GetCellData()->AddArray(view_of(name, data));
  for (const auto& [name, texts] : lines.texts) add_texts(*polydata, name, texts);
  return polydata;
}

/// VTK leaves unnoticed what fails when it closes the file; the end is then missing.
bool is_complete(const std::filesystem::path& path) {
  static const std::string end = "</VTKFile>\n";
  std::ifstream file(path, std::ios::binary);
  file.seekg(-static_cast<std::streamoff>(end.size()), std::ios::end);
  std::string last(end.size(), ' ');
  file.read(&last[0], static_cast<std::streamsize>(last.size()));
  return file && last == end;
}

std::string reason_of(unsigned long error) {
  if (error == vtkErrorCode::CannotOpenFileError) return "it cannot be opened; check the path";
  if (error == vtkErrorCode::NoError || error >= vtkErrorCode::FirstVTKErrorCode) return "the disk may be full";
  return std::generic_category().message(static_cast<int>(error));  // VTK hands on errno.
}

enum class Compression { none, lz4 };

void write(const std::filesystem::path& path, vtkPolyData& polydata, Compression compression) {
  vtkNew<vtkXMLPolyDataWriter> writer;
  // With an observer VTK reports errors to it instead of to the terminal.
  vtkNew<vtkCallbackCommand> silent;
  silent->SetCallback([](vtkObject*, unsigned long, void*, void*) {});
  for (const unsigned long event : {vtkCommand::ErrorEvent, vtkCommand::WarningEvent}) {
    writer->AddObserver(event, silent);
    writer->GetExecutive()->AddObserver(event, silent);
  }
  writer->SetFileName(path.c_str());
  writer->SetInputData(&polydata);
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  writer->SetHeaderTypeToUInt64();
  if (compression == Compression::lz4)
    writer->SetCompressorTypeToLZ4();
  else
    writer->SetCompressorTypeToNone();
  const bool written = writer->Write() == 1;
  const unsigned long error = writer->GetErrorCode();
  if (!written || error != vtkErrorCode::NoError || !is_complete(path))
    throw std::runtime_error(path.string() + ": cannot be written: " + reason_of(error));
}

}  // namespace

void write_vtp(const std::filesystem::path& path, const PointCloud& points) {
  write(path, *polydata_of(points), Compression::lz4);
}

void write_vtp(const std::filesystem::path& path, const PolylineData& lines) {
  write(path, *polydata_of(lines), Compression::none);
}

}  // namespace tensorray
