#pragma once
/// @file tests/structure/sources.h
/// The sources of the project as lines of text, for tests of rules about sources.

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/data_folder.h"

namespace tensorray::test {

struct Line {
  std::string file;  ///< Path relative to the source folder.
  std::string text;

  std::string folder() const { return std::filesystem::path(file).parent_path().string(); }
  bool is_under(const std::string& parent) const { return file.rfind(parent + "/", 0) == 0; }
  bool is_of_header() const { return std::filesystem::path(file).extension() == ".h"; }
};

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
