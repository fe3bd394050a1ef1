#include "volumes/vtk_files.h"

#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>

#include <vtkCallbackCommand.h>
#include <vtkCellArray.h>
#include <vtkCommand.h>
#include <vtkErrorCode.h>
#include <vtkExecutive.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataWriter.h>

namespace tensorray {
namespace {

/// A VTK array over memory that the caller keeps; VTK only reads it.
vtkNew<vtkFloatArray> view_of(const std::string& name, const float* values, int components, std::size_t points) {
  vtkNew<vtkFloatArray> array;
  array->SetName(name.c_str());
  array->SetNumberOfComponents(components);
  const vtkIdType count = static_cast<vtkIdType>(points) * components;
  array->SetArray(const_cast<float*>(values), count, /*save=*/1);
  return array;
}

const float* floats(const std::vector<Eigen::Vector3f>& vectors) {
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float), "vectors are contiguous");
  return reinterpret_cast<const float*>(vectors.data());
}

vtkNew<vtkPolyData> polydata_of(const PointCloud& cloud) {
  const std::size_t count = cloud.positions.size();
  vtkNew<vtkPolyData> polydata;
  vtkNew<vtkPoints> points;
  points->SetData(view_of("Points", floats(cloud.positions), 3, count));
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
    polydata->GetPointData()->AddArray(view_of(name, floats(values), 3, count));
  for (const auto& [key, value] : cloud.metadata) {
    vtkNew<vtkStringArray> text;
    text->SetName(key.c_str());
    text->InsertNextValue(value);
    polydata->GetFieldData()->AddArray(text);
  }
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

}  // namespace

void write_vtp(const std::filesystem::path& path, const PointCloud& points) {
  vtkNew<vtkXMLPolyDataWriter> writer;
  // With an observer VTK reports errors to it instead of to the terminal.
  vtkNew<vtkCallbackCommand> silent;
  silent->SetCallback([](vtkObject*, unsigned long, void*, void*) {});
  for (const unsigned long event : {vtkCommand::ErrorEvent, vtkCommand::WarningEvent}) {
    writer->AddObserver(event, silent);
    writer->GetExecutive()->AddObserver(event, silent);
  }
  writer->SetFileName(path.c_str());
  writer->SetInputData(polydata_of(points));
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  writer->SetHeaderTypeToUInt64();
  writer->SetCompressorTypeToLZ4();
  const bool written = writer->Write() == 1;
  const unsigned long error = writer->GetErrorCode();
  if (!written || error != vtkErrorCode::NoError || !is_complete(path))
    throw std::runtime_error(path.string() + ": cannot be written: " + reason_of(error));
}

}  // namespace tensorray
