#pragma once
/// The files of the project, and its sources as lines of text, for tests of rules about them.

#include <fstream>
#include <set>

#include "tests/data_folder.h"
#include "tests/files.h"

namespace tensorray::test {

struct Line {
  std::string file;  ///< Path relative to the source folder.
  std::string text;

  std::string folder() const { return std::filesystem::path(file).parent_path().string(); }
  bool is_under(const std::string& parent) const { return file.rfind(parent + "/", 0) == 0; }
  bool is_of_header() const { return std::filesystem::path(file).extension() == ".h"; }
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

/// The folders with C++ in the source folder. Each has a CMakeLists.txt. The folder tests is not among them.
inline std::set<std::string> top_folders() {
  std::set<std::string> folders;
  for (const auto& entry : std::filesystem::directory_iterator(source_folder()))
    if (std::filesystem::exists(entry.path() / "CMakeLists.txt")) folders.insert(entry.path().filename().string());
  folders.erase("tests");
  return folders;
}

/// All lines of the headers and sources in a folder and in the folders below it.
inline std::vector<Line> lines_of(const std::string& folder) {
  std::vector<Line> lines;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(source_folder() / folder)) {
    const std::string ending = entry.path().extension().string();
    if (ending != ".h" && ending != ".cpp") continue;
    std::ifstream file(entry.path());
    const std::string name = std::filesystem::relative(entry.path(), source_folder()).string();
    for (std::string text; std::getline(file, text);) lines.push_back({name, text});
  }
  EXPECT_FALSE(lines.empty()) << "no sources in " << folder;
  return lines;
}

}  // namespace tensorray::test
