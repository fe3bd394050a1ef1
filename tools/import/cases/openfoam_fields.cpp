#include "tools/import/cases/openfoam_fields.h"

#include <array>
#include <map>
#include <regex>
#include <string>

#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <zlib.h>

namespace tensorray {
namespace {

using Path = std::filesystem::path;

std::string without_comments(const std::string& text) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const bool is_line = text.compare(i, 2, "//") == 0;
    if (is_line || text.compare(i, 2, "/*") == 0) {
      const std::size_t end = is_line ? text.find('\n', i) : text.find("*/", i + 2);
      if (end == std::string::npos) break;
      result += ' ';
      i = end + (is_line ? 1 : 2);
    } else {
      result += text[i++];
    }
  }
  return result;
}

/// The beginning of a file, which may be compressed, without comments.
std::string head_of(const Path& path) {
  constexpr unsigned size = 1 << 16;  // The value of a uniform field stands before its patches.
  std::string text(size, '\0');
  const gzFile file = gzopen(path.c_str(), "rb");
  if (!file) return {};
  const int count = gzread(file, text.data(), size);
  gzclose(file);
  text.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  return without_comments(text);
}

/// What a file says of the values inside: one for all cells, or a list. Neither if they are elsewhere (a macro, or
/// another file that it includes).
enum class Values { uniform, list, elsewhere };

Values values_in(const std::string& head) {
  // Fields with patches have internalField, those without have value.
  const bool has_patches =
      head.find("internalField") != std::string::npos || head.find("boundaryField") != std::string::npos;
  const std::regex entry(has_patches ? R"(\binternalField\s+(uniform|nonuniform)\b)"
                                     : R"(\bvalue\s+(uniform|nonuniform)\b)");
  std::smatch match;
  if (!std::regex_search(head, match, entry)) return Values::elsewhere;
  return match[1] == "uniform" ? Values::uniform : Values::list;
}

/// The fields in a folder, by the names of their objects, which are those of VTK's arrays.
std::map<std::string, Values> fields_in(const Path& time) {
  std::map<std::string, Values> fields;
  for (const auto& entry : std::filesystem::directory_iterator(time)) {
    if (!entry.is_regular_file()) continue;
    const std::string head = head_of(entry.path());
    std::smatch name;
    if (std::regex_search(head, name, std::regex(R"(\bobject\s+"?([^\s;"]+))")))
      fields[name[1].str()] = values_in(head);
  }
  return fields;
}

bool is_same_everywhere(vtkDataArray& array) {
  for (int component = 0; component < array.GetNumberOfComponents(); ++component) {
    const double first = array.GetComponent(0, component);
    for (vtkIdType i = 1; i < array.GetNumberOfTuples(); ++i)
      if (array.GetComponent(i, component) != first) return false;
  }
  return true;
}

/// From OpenFOAM's order to VTK's.
void reorder(vtkDataArray& array) {
  constexpr std::array<std::size_t, 6> order{0, 3, 5, 1, 4, 2};  // Of VTK's components among OpenFOAM's.
  std::array<double, 6> theirs{}, ours{};
  for (vtkIdType i = 0; i < array.GetNumberOfTuples(); ++i) {
    array.GetTuple(i, theirs.data());
    for (std::size_t component = 0; component < 6; ++component) ours[component] = theirs[order[component]];
    array.SetTuple(i, ours.data());
  }
}

}  // namespace

void correct_uniform_tensors(vtkDataSet& data, const Path& time) {
  for (const auto& [name, values] : fields_in(time)) {
    if (values == Values::list) continue;
    for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL}) {
      vtkDataArray* const array = data.GetAttributes(type)->GetArray(name.c_str());
      if (!array || array->GetNumberOfComponents() != 6 || array->HasAComponentName()) continue;
      if (values == Values::uniform || is_same_everywhere(*array)) reorder(*array);
    }
  }
}

}  // namespace tensorray
