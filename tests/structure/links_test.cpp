// What pages in Markdown name exists: links of all pages lead to files, folders, pictures and headings, by the anchors
// that GitHub gives them.

#include <cctype>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>

#include "tests/structure/sources.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

/// The lines of a page without blocks of code: those between fences, and those that are indented after an empty line.
std::vector<std::string> prose_of(const fs::path& file) {
  std::ifstream page(file);
  std::vector<std::string> lines;
  bool is_fenced = false, may_begin_code = true;
  for (std::string line; std::getline(page, line);) {
    const bool is_fence = line.rfind("```", 0) == 0;
    const bool is_code = is_fenced || is_fence || (may_begin_code && line.rfind("    ", 0) == 0);
    if (is_fence) is_fenced = !is_fenced;
    may_begin_code = line.empty() || is_code;
    lines.push_back(is_code ? "" : line);
  }
  return lines;
}

/// The anchor of a heading: letters, digits, `_` and `-` in lower case, and `-` for blanks. All of a character beyond
/// ASCII counts as a letter.
std::string anchor_of(const std::string& heading) {
  std::string anchor;
  for (const char c : std::regex_replace(heading, std::regex(R"(\[([^\]]*)\]\([^)]*\))"), "$1")) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) || byte >= 0x80 || c == '_' || c == '-') anchor += static_cast<char>(std::tolower(byte));
    if (c == ' ') anchor += '-';
  }
  return anchor;
}

/// The anchors of a page: of equal ones, the second ends in -1, and so on.
std::set<std::string> anchors_in(const fs::path& page) {
  static const std::regex heading("#{1,6} +(.*)");
  std::map<std::string, int> counts;
  std::set<std::string> anchors;
  for (const std::string& line : prose_of(page)) {
    std::smatch match;
    if (!std::regex_match(line, match, heading)) continue;
    const std::string anchor = anchor_of(match[1]);
    const int count = counts[anchor]++;
    anchors.insert(count == 0 ? anchor : anchor + "-" + std::to_string(count));
  }
  return anchors;
}

/// Where the links and the pictures of a page lead, without those that are within code.
std::vector<std::string> targets_in(const fs::path& page) {
  static const std::regex target(R"(\]\(([^()\s]+)\)|<(?:img|a) (?:src|href)="([^"]*)\")");
  std::string text;
  bool is_code = false;
  for (const std::string& line : prose_of(page)) {
    if (line.empty()) is_code = false;  // Code within a text ends with its paragraph.
    for (const char c : line) {
      if (c == '`') is_code = !is_code;
      if (!is_code) text += c;
    }
    text += '\n';
  }
  std::vector<std::string> targets;
  for (std::sregex_iterator match(text.begin(), text.end(), target), end; match != end; ++match)
    targets.push_back((*match)[1].matched ? (*match)[1] : (*match)[2]);
  return targets;
}

/// What is wrong with a link on a page; empty: nothing.
std::string fault_of(const fs::path& page, const std::string& target) {
  if (std::regex_search(target, std::regex("^[a-z]+:"))) return "";  // Of another site.
  const std::size_t hash = target.find('#');
  const fs::path file = hash == 0 ? page : (page.parent_path() / target.substr(0, hash)).lexically_normal();
  if (fs::relative(file, test::source_folder()).string().rfind("..", 0) == 0) return "leads out of the project";
  if (!fs::exists(file)) return "does not exist";
  if (hash == std::string::npos) return "";
  return anchors_in(file).count(target.substr(hash + 1)) ? "" : "no heading has this anchor";
}

TEST(Links, LeadSomewhere) {
  std::size_t count = 0;
  for (const fs::path& page : test::files_of_project()) {
    if (page.extension() != ".md") continue;
    for (const std::string& target : targets_in(page)) {
      EXPECT_EQ(fault_of(page, target), "") << fs::relative(page, test::source_folder()).string() << ": " << target;
      ++count;
    }
  }
  EXPECT_GT(count, 100u);
}

/// Otherwise only a search finds it.
TEST(Links, LeadFromTheReadmeToEachPageForUsers) {
  std::set<fs::path> linked;
  for (const std::string& target : targets_in(test::source_folder() / "README.md"))
    linked.insert(fs::path(target.substr(0, target.find('#'))));
  for (const char* folder : {"docs", "docs/tutorials"})
    for (const auto& entry : fs::directory_iterator(test::source_folder() / folder))
      if (entry.path().extension() == ".md") {
        const fs::path page = fs::relative(entry.path(), test::source_folder());
        EXPECT_TRUE(linked.count(page)) << "README.md does not link to " << page;
      }
}

/// Each test that the list of promises names is there.
TEST(Links, OfThePromisesNameTests) {
  std::string sources;
  for (const fs::path& file : test::files_of_project())
    if (file.extension() == ".cpp" && fs::relative(file, test::source_folder()).begin()->string() == "tests")
      sources += bytes_of(file);
  static const std::regex name("`([A-Z]\\w*)\\.([A-Z]\\w*)`");
  const std::string page = bytes_of(test::source_folder() / "docs" / "dev" / "promises.md");
  std::size_t count = 0;
  for (std::sregex_iterator match(page.begin(), page.end(), name), end; match != end; ++match, ++count)
    EXPECT_NE(sources.find("(" + (*match)[1].str() + ", " + (*match)[2].str() + ")"), std::string::npos) << (*match)[0];
  EXPECT_GT(count, 30u);
}

/// The table of docs/dev/interfaces.md, the newcomer's page: paths exist, and types are in a file of the same row.
TEST(Links, OfTheInterfacesNameWhatExists) {
  static const std::regex code("`([^`]*)`");
  std::ifstream page(test::source_folder() / "docs" / "dev" / "interfaces.md");
  for (std::string row; std::getline(page, row);) {
    if (row.rfind("| [", 0) != 0) continue;
    std::string sources;
    for (const bool is_path : {true, false})
      for (std::sregex_iterator match(row.begin(), row.end(), code), end; match != end; ++match) {
        const std::string name = (*match)[1];
        if (is_path != (name.find('/') != std::string::npos)) continue;
        const fs::path file = test::source_folder() / name;
        EXPECT_TRUE(is_path ? fs::exists(file) : std::regex_search(sources, std::regex("\\b" + name + "\\b"))) << name;
        if (!is_path || !fs::is_regular_file(file)) continue;
        sources += bytes_of(file);
      }
  }
}

}  // namespace
}  // namespace tensorray
