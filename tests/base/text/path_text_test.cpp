// Paths as UTF-8: every path comes back, and names with a suffix fit.

#include "base/text/path_text.h"

#include <fstream>
#include <random>
#include <regex>
#include <set>

#include <gtest/gtest.h>

#include "base/files/temporary_folder.h"

namespace tensorray {
namespace {

/// Whether a text is UTF-8, by the table of the Unicode standard (table 3-7), which lists ranges of bytes.
bool is_utf8(const std::string& text) {
  static const std::regex table(
      "([\x01-\x7f]|[\xc2-\xdf][\x80-\xbf]|\xe0[\xa0-\xbf][\x80-\xbf]|[\xe1-\xec][\x80-\xbf]{2}|"
      "\xed[\x80-\x9f][\x80-\xbf]|[\xee-\xef][\x80-\xbf]{2}|\xf0[\x90-\xbf][\x80-\xbf]{2}|"
      "[\xf1-\xf3][\x80-\xbf]{3}|\xf4[\x80-\x8f][\x80-\xbf]{2})*");
  return std::regex_match(text, table);
}

TEST(PathTextTest, EachPathComesBack) {
  // Bytes of the characters that stand for others, too.
  const std::string likely = "aé\xef\x9e\x80\xef\x9f\xbf\xef\x9c\xff\xc0\xed\xa0\xf5\xf4\x90";
  std::mt19937 engine(5);
  std::set<std::string> texts, paths;
  for (int i = 0; i < 20000; ++i) {
    std::string bytes(1 + engine() % 8, 0);
    for (char& c : bytes) c = engine() % 2 ? likely[engine() % likely.size()] : static_cast<char>(1 + engine() % 255);
    const std::string text = utf8_of(bytes);
    ASSERT_TRUE(is_utf8(text)) << i;
    ASSERT_EQ(bytes_of_utf8(text), bytes) << i;
    if (is_utf8(bytes) && bytes.find("\xef\x9e") == std::string::npos && bytes.find("\xef\x9f") == std::string::npos) {
      ASSERT_EQ(text, bytes);
    }
    paths.insert(bytes);
    texts.insert(text);
  }
  EXPECT_EQ(texts.size(), paths.size());
}

TEST(PathTextTest, NamesWithASuffixFit) {
  const TemporaryFolder folder;
  EXPECT_EQ(with_suffix("a/b.png", ".checkpoint"), "a/b.png.checkpoint");
  EXPECT_EQ(with_suffix("b.png", ".new"), "b.png.new");
  for (std::size_t size = 235; size <= 255; ++size) {
    std::set<std::filesystem::path> names;
    for (const char end : {'1', '2'}) {
      std::filesystem::path file = folder / (std::string(size - 1, 'n') + end);
      for (const char* suffix : {".checkpoint", ".new"}) {
        file = with_suffix(file, suffix);
        EXPECT_LE(file.filename().string().size(), 255u);
        EXPECT_TRUE(std::ofstream(file).is_open()) << size;
        EXPECT_EQ(file.extension(), suffix);
        names.insert(file);
      }
    }
    EXPECT_EQ(names.size(), 4u) << size;
  }
  std::string umlauts;
  for (int i = 0; i < 127; ++i) umlauts += "ü";
  EXPECT_TRUE(is_utf8(with_suffix(folder / umlauts, ".checkpoint").string()));
}

}  // namespace
}  // namespace tensorray
