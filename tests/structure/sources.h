#pragma once
/// The files of the project, and its sources as lines of text, for tests of rules about them.

#include <fstream>

#include "tests/data_folder.h"
#include "tests/files.h"

namespace tensorray::test {

struct Line {
  std::string file;  ///< Path relative to the source folder.
  std::string text;

  std::string folder() const { return std::filesystem::path(file).parent_path().string(); }
  bool is_under(const std::string& parent) const { return file.rfind(parent + "/", 0) == 0; }
};

/// All files of the project, and none that a build has made.
inline std::vector<std::filesystem::path> files_of_project() {
  std::vector<std::filesystem::path> files;
  for (std::filesystem::recursive_directory_iterator entry(source_folder()), end; entry != end; ++entry) {
    const std::string name = entry->path().filename().string();
    const bool is_made_here = name == "build" || name == "node_modules" || name.front() == '.';
    if (entry->is_directory() && is_made_here) entry.disable_recursion_pending();
    if (entry->is_regular_file()) files.push_back(entry->path());
  }
  return files;
}

/// All lines of the headers and sources in the folders with a CMakeLists.txt of the source folder, but for the tests.
inline std::vector<Line> all_lines() {
  std::vector<Line> lines;
  for (const std::filesystem::path& path : files_of_project()) {
    const std::filesystem::path name = path.lexically_relative(source_folder()), top = *name.begin();
    const bool is_source = name.extension() == ".h" || name.extension() == ".cpp";
    if (!is_source || top == "tests" || !std::filesystem::exists(source_folder() / top / "CMakeLists.txt")) continue;
    std::ifstream file(path);
    for (std::string text; std::getline(file, text);) lines.push_back({name.string(), text});
  }
  EXPECT_FALSE(lines.empty());
  return lines;
}

}  // namespace tensorray::test
