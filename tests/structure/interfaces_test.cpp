// docs/dev/interfaces.md, the newcomer's page: its table names sources and types, which must exist.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/structure/sources.h"

namespace tensorray {
namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(test::source_folder() / file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// What a row of the table has in code style.
struct Row {
  std::vector<std::string> paths, names;
};

std::vector<Row> rows_of(const std::string& page) {
  static const std::regex row_of_table("\n\\| \\[[^\n]*"), code("`([^`]*)`");
  std::vector<Row> rows;
  for (std::sregex_iterator line(page.begin(), page.end(), row_of_table), end; line != end; ++line) {
    const std::string text = line->str();
    Row& row = rows.emplace_back();
    for (std::sregex_iterator word(text.begin(), text.end(), code); word != end; ++word) {
      const std::string name = (*word)[1];
      (name.find('/') == std::string::npos ? row.names : row.paths).push_back(name);
    }
  }
  return rows;
}

TEST(Interfaces, TheTableNamesWhatExists) {
  const std::vector<Row> rows = rows_of(text_of("docs/dev/interfaces.md"));
  EXPECT_EQ(rows.size(), 5u);
  for (const Row& row : rows) {
    std::string sources;
    for (const std::string& path : row.paths) {
      const std::filesystem::path source = test::source_folder() / path;
      EXPECT_TRUE(std::filesystem::exists(source)) << path;
      if (std::filesystem::is_regular_file(source)) sources += text_of(path);
    }
    for (const std::string& name : row.names)
      EXPECT_TRUE(std::regex_search(sources, std::regex("\\b" + name + "\\b"))) << name << " is in no file of its row";
  }
}

TEST(Interfaces, TheTableHasAllImplementations) {
  const std::string page = text_of("docs/dev/interfaces.md");
  const std::regex implementation("^class (\\w+).*: public (MethodWith|BendingRegion)\\b");
  int found = 0;
  for (const std::string& folder : test::top_folders())
    for (const test::Line& line : test::lines_of(folder)) {
      std::smatch match;
      if (!std::regex_search(line.text, match, implementation)) continue;
      ++found;
      EXPECT_NE(page.find("`" + match[1].str() + "` in `" + line.file + "`"), std::string::npos) << line.file;
    }
  EXPECT_GT(found, 1);
}

}  // namespace
}  // namespace tensorray
