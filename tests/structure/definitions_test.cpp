// Functions are defined in the room of their declaration.

#include <cctype>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/structure/sources.h"

namespace tensorray {
namespace {

using test::lines_of, test::top_folders;

/// A file without comments, text and directives.
std::string code_of(const std::string& file) {
  std::ifstream stream(test::source_folder() / file);
  std::string text{std::istreambuf_iterator<char>(stream), {}}, code;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto skip_to = [&](const std::string& end) {
      const std::size_t found = text.find(end, i + 1);
      i = found == std::string::npos ? text.size() : found + end.size() - 1;
    };
    if (text.compare(i, 2, "//") == 0 || (text[i] == '#' && (i == 0 || text[i - 1] == '\n'))) {
      skip_to("\n");
      code += '\n';
    } else if (text.compare(i, 3, "R\"(") == 0) {
      skip_to(")\"");
    } else if (text[i] == '"' || (text[i] == '\'' && !std::isalnum(static_cast<unsigned char>(text[i - 1])))) {
      for (const char quote = text[i]; ++i < text.size() && text[i] != quote;)
        if (text[i] == '\\') ++i;
    } else {
      code += text[i];
    }
  }
  return code;
}

/// The index behind the bracket that closes the one before `begin`.
std::size_t end_of_bracket(const std::string& code, std::size_t begin) {
  int depth = 1;
  for (; begin < code.size() && depth > 0; ++begin) {
    if (code[begin] == '(') ++depth;
    if (code[begin] == ')') --depth;
  }
  return begin;
}

std::set<std::string> files() {
  std::set<std::string> result;
  for (const std::string& top : top_folders())
    for (const test::Line& line : lines_of(top)) result.insert(line.file);
  return result;
}

/// Code without what stands between two texts, every time.
std::string without(std::string code, const std::string& begin, const std::string& end) {
  for (std::size_t first = 0; (first = code.find(begin, first)) != std::string::npos;) {
    const std::size_t last = code.find(end, first);
    code.erase(first, last == std::string::npos ? last : last + end.size() - first);
  }
  return code;
}

/// The functions outside of classes behind whose parameters `mark` stands: ';' of a declaration, '{' of a definition.
std::set<std::string> free_functions(const std::string& code, char mark) {
  static const std::regex begin(
      R"(\n(?!using|return|static|#|namespace|struct|class)[\w:][\w:<>,&* ]*[\w>&*] ?[&*]*\b(\w+)\()");
  std::set<std::string> names;
  for (auto match = std::sregex_iterator(code.begin(), code.end(), begin); match != std::sregex_iterator(); ++match) {
    const auto first = static_cast<std::size_t>(match->position() + match->length());
    const std::size_t end = code.find_first_not_of(" \n", end_of_bracket(code, first));
    if (end != std::string::npos && code[end] == mark) names.insert((*match)[1]);
  }
  return names;
}

std::string folder_of(const std::string& file) { return file.substr(0, file.rfind('/')); }

/// Otherwise two rooms may need each other without an include that shows it: only the linker would see the circle.
TEST(Structure, FunctionsAreDefinedInTheRoomThatDeclaresThem) {
  std::map<std::string, std::set<std::string>> rooms;
  for (const std::string& file : files())
    if (file.substr(file.rfind('.')) == ".h")
      for (const std::string& name : free_functions(code_of(file), ';')) rooms[name].insert(folder_of(file));
  for (const std::string& file : files()) {
    if (file.substr(file.rfind('.')) == ".h") continue;
    const std::string of_targets = without(code_of(file), "HWY_BEFORE_NAMESPACE", "HWY_AFTER_NAMESPACE");
    for (const std::string& name : free_functions(without(of_targets, "namespace {\n", "\n}  \n"), '{'))
      EXPECT_TRUE(!rooms.count(name) || rooms[name].count(folder_of(file)))
          << file << " defines " << name << ", which a header of another room declares";
  }
  EXPECT_TRUE(rooms.at("trace").count("tracing/trace"));
}

}  // namespace
}  // namespace tensorray
