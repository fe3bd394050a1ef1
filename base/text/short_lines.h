#pragma once
/// @file base/text/short_lines.h
/// The lines of files that have words and numbers, and perhaps bytes of any kind between them.

#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

namespace tensorray {

/// Calls `visit(line)` for each line of a file until it returns false. A line of more than `longest` characters is
/// passed as an empty one: it has no word that is looked for.
template <class Visit>
void for_each_short_line(const std::filesystem::path& path, std::size_t longest, const Visit& visit) {
  std::ifstream file(path, std::ios::binary);
  std::string line(longest + 2, '\0');
  while (!file.eof() && !file.bad()) {
    file.getline(line.data(), static_cast<std::streamsize>(line.size()));
    const bool is_long = file.fail() && !file.eof() && !file.bad();
    if (is_long) {
      file.clear();
      file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
    }
    if (!visit(is_long ? std::string() : std::string(line.c_str()))) return;
  }
}

}  // namespace tensorray
