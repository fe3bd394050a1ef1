// docs/dev/interfaces.md, the newcomer's page: what it names in its table must exist.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "tests/data_folder.h"

namespace tensorray {
namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Paths exist, and types are in a file of the same row.
TEST(Interfaces, TheTableNamesWhatExists) {
  const std::regex row("\n\\| \\[[^\n]*"), code("`([^`]*)`");
  const std::string page = text_of(test::source_folder() / "docs" / "dev" / "interfaces.md");
  int rows = 0;
  for (std::sregex_iterator line(page.begin(), page.end(), row), end; line != end; ++line, ++rows) {
    const std::string text = line->str();
    std::string sources;
    for (std::sregex_iterator word(text.begin(), text.end(), code); word != end; ++word) {
      const std::string name = (*word)[1];
      const bool is_path = name.find('/') != std::string::npos;
      EXPECT_TRUE(!is_path || std::filesystem::exists(test::source_folder() / name)) << name;
      if (std::filesystem::is_regular_file(test::source_folder() / name))
        sources += text_of(test::source_folder() / name);
    }
    for (std::sregex_iterator word(text.begin(), text.end(), code); word != end; ++word) {
      const std::string name = (*word)[1];
      EXPECT_TRUE(name.find('/') != std::string::npos || std::regex_search(sources, std::regex("\\b" + name + "\\b")))
          << name << " is in no file of its row";
    }
  }
  EXPECT_GT(rows, 1);
}

}  // namespace
}  // namespace tensorray
