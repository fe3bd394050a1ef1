#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <new>
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

#include "base/text/text.h"
#include "tools/import/vtk/vtk_messages.h"
#include "tools/import/vtk_formats/vtk_counts.h"
#include "tools/import/vtk_formats/vtp_files.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;
using Indices = std::vector<vtkIdType>;

[[noreturn]] void fail_damaged(const std::string& what) {
  throw std::runtime_error(what + ": the file is damaged or cut off; write it again");
}

std::string read_part(const Path& path, std::uintmax_t offset, std::size_t count) {
  std::ifstream file(path, std::ios::binary);
  std::string text(count, '\0');
  file.seekg(static_cast<std::streamoff>(offset));
  file.read(&text[0], static_cast<std::streamsize>(count));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  return text;
}

/// VTK's message about a file of another kind does not help the user, and VTK does not check the end of appended
/// data.
void check_kind_and_end(const Path& path) {
  constexpr std::size_t head_size = 4096, tail_size = 256;
  const std::string head = read_part(path, 0, head_size);
  const std::size_t root = head.find("<VTKFile");
  if (root == std::string::npos) throw std::runtime_error("it is not VTK polydata in VTK's XML format");
  const std::string tag = head.substr(root, head.find('>', root) - root);
  const std::size_t type = tag.find("type=");
  const std::string rest = type == std::string::npos ? "" : tag.substr(type + 5);
  if (rest.size() < 2 || rest.compare(1, 9, std::string("PolyData") + rest[0]) != 0) {
    const std::string found = rest.empty() ? "" : rest.substr(1, rest.find(rest[0], 1) - 1);
    throw std::runtime_error("it is not VTK polydata but \"" + escaped(found) + "\"");
  }
  const std::uintmax_t size = std::filesystem::file_size(path),
                       begin = size - std::min<std::uintmax_t>(size, tail_size);
  std::string tail = read_part(path, begin, tail_size);
  tail.erase(tail.find_last_not_of(" \t\r\n") + 1);
  if (!ends_with(tail, "</VTKFile>")) fail_damaged("its end is missing");
}

void choose(vtkDataArraySelection& arrays, const std::set<std::string>& wanted) {
  for (int i = 0; i < arrays.GetNumberOfArrays(); ++i)
    if (wanted.count(arrays.GetArrayName(i)) == 0) arrays.DisableArray(arrays.GetArrayName(i));
}

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++count;
  return count;
}

/// The file without its appended data.
std::string xml_of(const Path& path) {
  std::string text = read_part(path, 0, std::filesystem::file_size(path));
  text.resize(std::min(text.size(), text.find("<AppendedData")));
  return text;
}

/// VTK takes a count that it cannot read for 0, and leaves out what it counts.
void check_counts(const std::string& text) {
  for (std::size_t at = text.find("<Piece"); at != std::string::npos; at = text.find("<Piece", at + 1)) {
    const std::string tag = text.substr(at, text.find('>', at) - at);
    for (const char* name : {"NumberOfPoints", "NumberOfVerts", "NumberOfLines", "NumberOfStrips", "NumberOfPolys"}) {
      const std::size_t found = tag.find(name + std::string("="));
      if (found == std::string::npos) continue;
      const std::size_t begin = std::min(found + std::strlen(name) + 2, tag.size());  // Behind a quotation mark.
      std::int64_t count = 0;
      const auto result = std::from_chars(tag.data() + begin, tag.data() + tag.size(), count);
      const bool ends = result.ptr != tag.data() + tag.size() && (*result.ptr == '"' || *result.ptr == '\'');
      if (result.ec != std::errc() || count < 0 || !ends) fail_damaged(std::string("its ") + name + " is no count");
    }
  }
}

/// The arrays that each piece of the file has. VTK leaves the values of the other pieces undefined.
std::set<std::string> in_every_piece(const std::string& text, const std::set<std::string>& wanted) {
  const std::size_t pieces = occurrences(text, "<Piece");
  std::set<std::string> complete;
  for (const std::string& name : wanted)
    if (pieces <= 1 || occurrences(text, "Name=\"" + name + "\"") >= pieces) complete.insert(name);
  return complete;
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
Named<DataArray> chosen(vtkDataSetAttributes& attributes, const std::set<std::string>& wanted, vtkIdType count,
                        const Indices& selected) {
  Named<DataArray> arrays;
  for (const std::string& name : wanted) {
    vtkDataArray* const array = attributes.GetArray(name.c_str());
    if (!array) continue;
    if (array->GetNumberOfTuples() != count)
      fail_damaged("the array \"" + name + "\" has not one value for each of what it describes");
    arrays.emplace_back(name, doubles(*array, selected));
  }
  return arrays;
}

PolyData lines_of(vtkPolyData& polydata, const std::set<std::string>& wanted) {
  PolyData data;
  data.has_lines = true;
  const Selection selection = selection_of(polydata);
  if (!selection.points.empty()) data.points = doubles(*polydata.GetPoints()->GetData(), selection.points);
  data.line_ends = selection.line_ends;
  data.point_data = chosen(*polydata.GetPointData(), wanted, polydata.GetNumberOfPoints(), selection.points);
  data.line_data = chosen(*polydata.GetCellData(), wanted, polydata.GetNumberOfCells(), selection.lines);
  return data;
}

}  // namespace

PolyData read_vtp_file(const Path& path, const std::set<std::string>& asked) {
  check_kind_and_end(path);
  const std::string text = xml_of(path);
  check_counts(text);
  if (const std::string reason = impossible_xml_count(path); !reason.empty()) throw std::runtime_error("it " + reason);
  const std::set<std::string> wanted = in_every_piece(text, asked);
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
