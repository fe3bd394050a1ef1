#pragma once
/// @file tools/import/vtk_formats/vtk_tags.h
/// The tags of VTK's XML files, without a parser: files may be large, and have bytes between tags. Private to the
/// importer.

#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

namespace tensorray {

/// The value of `name="value"` at or after `from`; moves `from` past it. Empty if there is none.
inline std::string attribute(const std::string& text, const std::string& name, std::size_t& from) {
  const std::size_t start = text.find(name + "=", from);
  if (start == std::string::npos || start + name.size() + 1 >= text.size()) return {};
  const std::size_t open = start + name.size() + 1;
  const std::size_t close = text.find(text[open], open + 1);  // Either kind of quotation mark.
  if (close == std::string::npos) return {};
  from = close + 1;
  return text.substr(open + 1, close - open - 1);
}

inline std::string attribute(const std::string& text, const std::string& name) {
  std::size_t from = 0;
  return attribute(text, name, from);
}

/// Calls `visit(tag)` for each tag, without its brackets, up to the appended data.
template <class Visit>
void for_each_tag(const std::filesystem::path& path, const Visit& visit) {
  std::ifstream file(path, std::ios::binary);
  constexpr auto any_number = std::numeric_limits<std::streamsize>::max();
  for (std::string tag; file.ignore(any_number, '<') && std::getline(file, tag, '>');) {
    if (tag.compare(0, 12, "AppendedData") == 0) return;
    visit(tag);
  }
}

}  // namespace tensorray
