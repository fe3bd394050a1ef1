// Paths as UTF-8: every path comes back, and names with a suffix fit.

#include "base/text/path_text.h"

#include <fstream>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "base/files/temporary_folder.h"

namespace tensorray {
namespace {

/// Whether a text is UTF-8, by the table of the Unicode standard (table 3-7), which lists ranges of bytes.
bool is_utf8(const std::string& text) {
  struct Row {
    unsigned first[2], second[2];
    int size;
  };
  const std::vector<Row> rows{
      {{0x00, 0x7f}, {0, 0}, 1},       {{0xc2, 0xdf}, {0x80, 0xbf}, 2}, {{0xe0, 0xe0}, {0xa0, 0xbf}, 3},
      {{0xe1, 0xec}, {0x80, 0xbf}, 3}, {{0xed, 0xed}, {0x80, 0x9f}, 3}, {{0xee, 0xef}, {0x80, 0xbf}, 3},
      {{0xf0, 0xf0}, {0x90, 0xbf}, 4}, {{0xf1, 0xf3}, {0x80, 0xbf}, 4}, {{0xf4, 0xf4}, {0x80, 0x8f}, 4}};
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const auto is_in = [](unsigned value, const unsigned(&range)[2]) { return value >= range[0] && value <= range[1]; };
  for (std::size_t at = 0; at < text.size();) {
    const Row* found = nullptr;
    for (const Row& row : rows)
      if (is_in(byte(at), row.first) && (row.size == 1 || is_in(byte(at + 1), row.second))) found = &row;
    if (!found) return false;
    for (int i = 2; i < found->size; ++i)
      if ((byte(at + static_cast<std::size_t>(i)) & 0xc0u) != 0x80u) return false;
    at += static_cast<std::size_t>(found->size);
  }
  return true;
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
