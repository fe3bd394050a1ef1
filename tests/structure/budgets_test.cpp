// The budgets of lines in CONTRIBUTING.md.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "tests/structure/sources.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

/// The lines of all sources by folder, for every folder above a source; "" is the whole project.
std::map<std::string, long> lines_by_folder() {
  const std::set<std::string> endings{".h", ".cpp", ".py", ".ts", ".css", ".html"};
  std::map<std::string, long> lines;
  for (const fs::path& path : test::files_of_project()) {
    if (!endings.count(path.extension().string())) continue;
    std::ifstream file(path);
    const long count = std::count(std::istreambuf_iterator<char>(file), {}, '\n');
    fs::path folder = fs::relative(path, test::source_folder());
    do {
      folder = folder.parent_path();
      lines[folder.string()] += count;
    } while (!folder.empty());
  }
  return lines;
}

/// The rows "| `folder` | 1,234 |" of the section "Lines".
std::map<std::string, long> budgets() {
  std::ifstream page(test::source_folder() / "CONTRIBUTING.md");
  const std::regex row(R"(\| `([\w/]+)` \| ([\d,]+) \|.*)");
  std::map<std::string, long> found;
  bool is_section = false;
  for (std::string line; std::getline(page, line);) {
    if (line.rfind("## ", 0) == 0) is_section = line == "## Lines";
    std::smatch match;
    if (is_section && std::regex_match(line, match, row))
      found[match[1]] = std::stol(std::regex_replace(match[2].str(), std::regex(","), ""));
  }
  return found;
}

std::string with_commas(long number) {
  std::string text = std::to_string(number);
  for (auto at = static_cast<int>(text.size()) - 3; at > 0; at -= 3) text.insert(static_cast<std::size_t>(at), ",");
  return text;
}

TEST(Budgets, AreKept) {
  const std::map<std::string, long> all = budgets();
  std::map<std::string, long> lines = lines_by_folder();
  for (const auto& [folder, budget] : all)
    EXPECT_LE(lines[folder], budget) << folder << " has " << with_commas(lines[folder]) << " lines, its budget is "
                                     << with_commas(budget) << ": CONTRIBUTING.md, Lines";
  for (const auto& [folder, count] : lines) {
    const bool is_top = !folder.empty() && folder.find('/') == std::string::npos;
    EXPECT_TRUE(!is_top || all.count(folder))
        << folder << " has " << with_commas(count) << " lines and no budget: CONTRIBUTING.md, Lines";
  }
}

}  // namespace
}  // namespace tensorray
