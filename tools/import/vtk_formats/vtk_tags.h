#pragma once
/// The tags of VTK's XML files, without a parser: files may be large, and have bytes between tags.

#include <algorithm>
#include <cstdlib>
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

/// Whether a tag of an array, or any other, announces a number of components that VTK can take time and memory for.
inline bool has_possible_components(const std::string& tag) {
  const double components = std::strtod(attribute(tag, "NumberOfComponents").c_str(), nullptr);
  return components >= 0 && components <= 100000;
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

/// Whether a file ends with the tag that closes it: VTK does not check the end of appended data.
inline bool is_closed(const std::filesystem::path& path) {
  const auto size = static_cast<std::streamoff>(std::filesystem::file_size(path));
  std::string tail(static_cast<std::size_t>(std::min<std::streamoff>(size, 256)), '\0');
  std::ifstream file(path, std::ios::binary);
  file.seekg(size - static_cast<std::streamoff>(tail.size()));
  file.read(tail.data(), static_cast<std::streamsize>(tail.size()));
  return tail.find("</VTKFile>") != std::string::npos;
}

}  // namespace tensorray
