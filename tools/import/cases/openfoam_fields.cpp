#include "tools/import/cases/openfoam_fields.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <vector>

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

/// The words, perhaps in quotation marks, that follow a key and blanks.
std::vector<std::string> words_after(const std::string& text, const std::string& key) {
  const auto is_of_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  std::vector<std::string> words;
  for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key, at + 1)) {
    const std::size_t end_of_key = at + key.size();
    std::size_t begin = text.find_first_not_of(" \t\r\n\v\f", end_of_key);
    if ((at > 0 && is_of_word(text[at - 1])) || begin == std::string::npos || begin == end_of_key) continue;
    if (text[begin] == '"') ++begin;
    const std::size_t end = std::min(text.find_first_of(" \t\r\n\v\f;\"", begin), text.size());
    if (end > begin) words.push_back(text.substr(begin, end - begin));
  }
  return words;
}

/// Whether a file says that its values are a list: neither one for all cells, nor elsewhere (in a macro, or in another
/// file that it includes).
bool has_list(const std::string& head) {
  // Fields with patches have internalField, those without have value.
  const bool has_patches =
      head.find("internalField") != std::string::npos || head.find("boundaryField") != std::string::npos;
  for (const std::string& word : words_after(head, has_patches ? "internalField" : "value"))
    if (word == "uniform" || word == "nonuniform") return word == "nonuniform";
  return false;
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
  for (const auto& entry : std::filesystem::directory_iterator(time)) {
    const std::string head = entry.is_regular_file() ? head_of(entry.path()) : "";
    const std::vector<std::string> names = words_after(head, "object");  // VTK's arrays have them.
    if (names.empty() || has_list(head)) continue;
    for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL}) {
      vtkDataArray* const array = data.GetAttributes(type)->GetArray(names.front().c_str());
      if (!array || array->GetNumberOfComponents() != 6 || array->HasAComponentName()) continue;
      if (is_same_everywhere(*array)) reorder(*array);
    }
  }
}

}  // namespace tensorray
