#include <map>
#include <new>
#include <optional>
#include <stdexcept>
#include <vector>

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataArraySelection.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkXMLPolyDataReader.h>

#include "base/process/process_limits.h"
#include "base/text/text.h"
#include "tools/import/vtk/vtk_data_sets.h"
#include "tools/import/vtk/vtk_messages.h"
#include "tools/import/vtk_formats/vtk_tags.h"
#include "tools/import/vtk_formats/vtp_files.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;
using Indices = std::vector<vtkIdType>;

[[noreturn]] void fail_damaged(const std::string& what) {
  throw std::runtime_error(what + ": the file is damaged or cut off; write it again");
}

/// What the tags of a file say that VTK does not check.
struct Tags {
  int pieces = 0;
  std::map<std::string, int> arrays;  ///< How many have a name.
};

/// VTK's message about a file of another kind does not help the user.
Tags read_tags(const Path& path) {
  Tags tags;
  std::optional<std::string> type;
  for_each_tag(path, [&](const std::string& tag) {
    if (starts_with(tag, "VTKFile")) type = attribute(tag, "type");
    if (starts_with(tag, "Piece")) ++tags.pieces;
    if (starts_with(tag, "DataArray")) ++tags.arrays[attribute(tag, "Name")];
    if (!has_possible_components(tag)) fail_damaged("one of its arrays has no such number of components");
  });
  if (!type) throw std::runtime_error("it is not VTK polydata in VTK's XML format");
  if (type != "PolyData") throw std::runtime_error("it is not VTK polydata but \"" + escaped(*type) + "\"");
  if (!is_closed(path)) fail_damaged("its end is missing");
  return tags;
}

void choose(vtkDataArraySelection& arrays, const std::set<std::string>& wanted) {
  for (int i = 0; i < arrays.GetNumberOfArrays(); ++i)
    if (wanted.count(arrays.GetArrayName(i)) == 0) arrays.DisableArray(arrays.GetArrayName(i));
}

/// The points and lines whose values are read. VTK orders cells as vertices, then lines.
struct Selection {
  Indices points, lines;
  std::vector<std::size_t> line_ends;
};

/// VTK does not check the point indices of lines.
Selection selection_of(vtkPolyData& polydata) {
  Selection selection;
  vtkCellArray& lines = *polydata.GetLines();
  vtkDataArray &offsets = *lines.GetOffsetsArray(), &corners = *lines.GetConnectivityArray();
  const vtkIdType vertices = polydata.GetNumberOfVerts(), count = lines.GetNumberOfCells();
  const auto offset = [&](vtkIdType line) { return static_cast<vtkIdType>(offsets.GetComponent(line, 0)); };
  for (vtkIdType line = 0; line < count; ++line) {
    if (offset(line) < 0 || offset(line + 1) < offset(line) || offset(line + 1) > corners.GetNumberOfTuples())
      fail_damaged("the offsets of its lines do not grow, or are more than it holds");
    for (vtkIdType i = offset(line); i < offset(line + 1); ++i) {
      const auto point = static_cast<vtkIdType>(corners.GetComponent(i, 0));
      if (point < 0 || point >= polydata.GetNumberOfPoints()) fail_damaged("a line names a point that is not there");
      selection.points.push_back(point);
    }
    selection.lines.push_back(vertices + line);
    selection.line_ends.push_back(selection.points.size());
  }
  return selection;
}

DataArray doubles(vtkDataArray& array, const Indices& selected) {
  const int components = array.GetNumberOfComponents();
  std::vector<double> values;
  values.reserve(selected.size() * static_cast<std::size_t>(components));
  for (const vtkIdType i : selected)
    for (int component = 0; component < components; ++component) values.push_back(array.GetComponent(i, component));
  return {components, std::move(values)};
}

/// The wanted numeric arrays that have `count` values.
std::map<std::string, DataArray> chosen(vtkDataSetAttributes& attributes, const std::set<std::string>& wanted,
                                        vtkIdType count, const Indices& selected) {
  std::map<std::string, DataArray> arrays;
  for (const std::string& name : wanted) {
    vtkDataArray* const array = attributes.GetArray(name.c_str());
    if (!array) continue;
    if (array->GetNumberOfTuples() != count)
      fail_damaged("the array \"" + name + "\" has not one value for each of what it describes");
    arrays.emplace(name, doubles(*array, selected));
  }
  return arrays;
}

PolylineData lines_of(vtkPolyData& polydata, const std::set<std::string>& wanted) {
  PolylineData data;
  const Selection selection = selection_of(polydata);
  for (const vtkIdType point : selection.points) data.points.emplace_back(polydata.GetPoints()->GetPoint(point));
  data.line_ends = selection.line_ends;
  data.point_data = chosen(*polydata.GetPointData(), wanted, polydata.GetNumberOfPoints(), selection.points);
  data.line_data = chosen(*polydata.GetCellData(), wanted, polydata.GetNumberOfCells(), selection.lines);
  return data;
}

}  // namespace

PolylineData read_vtp_file(const Path& path, const std::set<std::string>& asked) {
  const Tags tags = read_tags(path);
  std::set<std::string> wanted;  // Of an array that some pieces lack, VTK leaves the values there undefined.
  for (const std::string& name : asked)
    if (const auto found = tags.arrays.find(name); found != tags.arrays.end() && found->second >= tags.pieces)
      wanted.insert(name);
  const ExtraMemoryLimit limit(max_memory_of(path));
  const VtkMessages messages;
  try {
    vtkNew<vtkXMLPolyDataReader> reader;
    reader->SetFileName(path.c_str());
    reader->UpdateInformation();
    choose(*reader->GetPointDataArraySelection(), wanted);
    choose(*reader->GetCellDataArraySelection(), wanted);
    reader->Update();
    if (!messages.first_error().empty()) fail_damaged("VTK cannot read it: " + messages.first_error());
    return lines_of(*reader->GetOutput(), wanted);
  } catch (const std::bad_alloc&) {
    fail_damaged("it announces more than memory holds");
  }
}

}  // namespace tensorray
