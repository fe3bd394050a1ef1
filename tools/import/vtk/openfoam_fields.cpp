#include "tools/import/vtk/openfoam_fields.h"

#include <array>
#include <map>
#include <optional>
#include <regex>
#include <sstream>
#include <string>

#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <zlib.h>

namespace tensorray {
namespace {

using Path = std::filesystem::path;
using Symmetric = std::array<double, 6>;

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

/// The components of a uniform field of symmetric tensors, in OpenFOAM's order; none if it is something else.
std::optional<Symmetric> uniform_tensor(const std::string& head) {
  // Fields with patches have internalField, those without have value.
  const bool has_patches = head.find("internalField") != std::string::npos;
  const std::regex entry(has_patches ? R"(\binternalField\s+uniform\s*\(([^()]*)\))"
                                     : R"(\bvalue\s+uniform\s*\(([^()]*)\))");
  std::smatch match;
  if (!std::regex_search(head, match, entry)) return {};
  std::istringstream numbers(match[1].str());
  Symmetric tensor{};
  for (double& number : tensor)
    if (!(numbers >> number)) return {};
  std::string more;
  if (numbers >> more) return {};
  return tensor;
}

/// The uniform symmetric tensors in a folder, by the names of their objects, which are those of VTK's arrays.
std::map<std::string, Symmetric> uniform_tensors(const Path& time) {
  std::map<std::string, Symmetric> tensors;
  for (const auto& entry : std::filesystem::directory_iterator(time)) {
    if (!entry.is_regular_file()) continue;
    const std::string head = head_of(entry.path());
    std::smatch name;
    if (!std::regex_search(head, name, std::regex(R"(\bobject\s+"?([^\s;"]+))"))) continue;
    if (const auto tensor = uniform_tensor(head)) tensors[name[1].str()] = *tensor;
  }
  return tensors;
}

}  // namespace

void correct_uniform_tensors(vtkDataSet& data, const Path& time) {
  constexpr std::array<std::size_t, 6> order{0, 3, 5, 1, 4, 2};  // Of VTK's components among OpenFOAM's.
  for (const auto& [name, tensor] : uniform_tensors(time)) {
    for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL}) {
      vtkDataArray* const array = data.GetAttributes(type)->GetArray(name.c_str());
      if (!array || array->GetNumberOfComponents() != 6) continue;
      for (int component = 0; component < 6; ++component)
        array->FillComponent(component, tensor[order[static_cast<std::size_t>(component)]]);
    }
  }
}

}  // namespace tensorray
