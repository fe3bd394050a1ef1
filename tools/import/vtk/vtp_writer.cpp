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

#include "tools/import/vtk/vtp_files.h"

namespace tensorray {
namespace {

vtkSmartPointer<vtkAOSDataArrayTemplate<double>> new_array(double) { return vtkSmartPointer<vtkDoubleArray>::New(); }
vtkSmartPointer<vtkAOSDataArrayTemplate<float>> new_array(float) { return vtkSmartPointer<vtkFloatArray>::New(); }
vtkSmartPointer<vtkAOSDataArrayTemplate<int>> new_array(std::int32_t) { return vtkSmartPointer<vtkIntArray>::New(); }
vtkSmartPointer<vtkAOSDataArrayTemplate<unsigned char>> new_array(std::uint8_t) {
  return vtkSmartPointer<vtkUnsignedCharArray>::New();
}

/// A VTK array that refers to memory of the caller. VTK only reads it.
template <class Number>
vtkSmartPointer<vtkDataArray> vtk_view(const std::string& name, const NumberSpan<Number>& numbers, int components) {
  const auto array = new_array(Number());
  array->SetName(name.c_str());
  array->SetNumberOfComponents(components);
  array->SetArray(const_cast<Number*>(numbers.data), static_cast<vtkIdType>(numbers.size), /*save=*/1);
  return array;
}

vtkSmartPointer<vtkDataArray> vtk_view(const std::string& name, const DataView& view) {
  return std::visit([&](const auto& numbers) { return vtk_view(name, numbers, view.components); }, view.values);
}

vtkIdType value_count(const DataView& view) {
  return std::visit([&](const auto& numbers) { return static_cast<vtkIdType>(numbers.size) / view.components; },
                    view.values);
}

/// One vertex cell per point.
vtkSmartPointer<vtkCellArray> vertices(vtkIdType count) {
  const auto cells = vtkSmartPointer<vtkCellArray>::New();
  cells->AllocateExact(count, count);
  for (vtkIdType i = 0; i < count; ++i) cells->InsertNextCell(1, &i);
  return cells;
}

/// Polylines of consecutive points.
vtkSmartPointer<vtkCellArray> polylines(const std::vector<std::size_t>& line_ends, vtkIdType point_count) {
  vtkNew<vtkTypeInt64Array> ends, corners;
  ends->InsertNextValue(0);
  for (const std::size_t end : line_ends) ends->InsertNextValue(static_cast<vtkTypeInt64>(end));
  corners->SetNumberOfValues(point_count);
  std::iota(corners->GetPointer(0), corners->GetPointer(0) + point_count, vtkTypeInt64{0});
  const auto cells = vtkSmartPointer<vtkCellArray>::New();
  cells->SetData(ends, corners);
  return cells;
}

void add_texts(vtkPolyData& polydata, const std::string& name, const Texts& lines) {
  vtkNew<vtkStringArray> text;
  text->SetName(name.c_str());
  for (const std::string& line : lines) text->InsertNextValue(line);
  polydata.GetFieldData()->AddArray(text);
}

/// Names what ParaView shows at first, and what its filters of vectors and tensors take.
void activate_arrays(vtkPolyData& polydata) {
  vtkPointData& points = *polydata.GetPointData();
  points.SetActiveScalars(points.HasArray("force") ? "force" : "wavelength");
  points.SetActiveVectors("direction");
  points.SetActiveTensors("tensor");
}

vtkNew<vtkPolyData> polydata_of(const PolyDataView& data) {
  vtkNew<vtkPolyData> polydata;
  vtkNew<vtkPoints> points;
  points->SetData(vtk_view("Points", data.points));
  polydata->SetPoints(points);
  if (data.line_ends)
    polydata->SetLines(polylines(*data.line_ends, value_count(data.points)));
  else
    polydata->SetVerts(vertices(value_count(data.points)));
  for (const auto& [name, values] : data.point_data) polydata->GetPointData()->AddArray(vtk_view(name, values));
  for (const auto& [name, values] : data.line_data) polydata->GetCellData()->AddArray(vtk_view(name, values));
  for (const auto& [name, texts] : data.texts) add_texts(*polydata, name, texts);
  activate_arrays(*polydata);
  return polydata;
}

/// VTK does not notice errors when it closes the file. The end of the file is then missing.
bool is_complete(const std::filesystem::path& path) {
  static const std::string end = "</VTKFile>\n";
  std::ifstream file(path, std::ios::binary);
  file.seekg(-static_cast<std::streamoff>(end.size()), std::ios::end);
  std::string last(end.size(), ' ');
  file.read(&last[0], static_cast<std::streamsize>(last.size()));
  return file && last == end;
}

/// Writes data where their arrays are. Data at the end of the file stop Debian 12's ParaView, whose libexpat is newer
/// than itself.
class InlineWriter : public vtkXMLPolyDataWriter {
 public:
  static InlineWriter* New() { VTK_STANDARD_NEW_BODY(InlineWriter); }

 protected:
  InlineWriter() { SetDataModeToBinary(); }

  /// Where the disk is full, VTK would delete arrays that it makes for data at the end of the file alone.
  void DeletePositionArrays() override {}
};

std::string reason_of(unsigned long error) {
  if (error == vtkErrorCode::CannotOpenFileError) return "it cannot be opened; check the path";
  if (error == vtkErrorCode::NoError || error >= vtkErrorCode::FirstVTKErrorCode) return "the disk may be full";
  return std::generic_category().message(static_cast<int>(error));  // VTK returns errno.
}

}  // namespace

void write_vtp_file(const std::filesystem::path& path, const PolyDataView& data) {
  vtkNew<InlineWriter> writer;
  // With an observer, VTK does not print errors on the terminal.
  vtkNew<vtkCallbackCommand> silent;
  silent->SetCallback([](vtkObject*, unsigned long, void*, void*) {});
  for (const unsigned long event : {vtkCommand::ErrorEvent, vtkCommand::WarningEvent}) {
    writer->AddObserver(event, silent);
    writer->GetExecutive()->AddObserver(event, silent);
  }
  const vtkNew<vtkPolyData> polydata = polydata_of(data);
  writer->SetFileName(path.c_str());
  writer->SetInputData(polydata);
  writer->SetHeaderTypeToUInt64();
  if (data.line_ends)
    writer->SetCompressorTypeToNone();
  else
    writer->SetCompressorTypeToLZ4();
  const bool written = writer->Write() == 1;
  const unsigned long error = writer->GetErrorCode();
  if (!written || error != vtkErrorCode::NoError || !is_complete(path)) throw std::runtime_error(reason_of(error));
}

}  // namespace tensorray
