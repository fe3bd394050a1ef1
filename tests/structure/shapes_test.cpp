// The shape of functions and classes: short lists of parameters, and few members.

#include <algorithm>
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

/// The index behind the bracket that closes the one before `begin`; and what stands at the level between them.
std::size_t end_of_bracket(const std::string& code, std::size_t begin, std::string& level) {
  int depth = 1, angles = 0;
  std::size_t i = begin;
  for (; i < code.size() && depth > 0; ++i) {
    const char c = code[i];
    if (c == ')' || c == ']' || c == '}') --depth;
    if (c == '>' && angles > 0) --angles;
    if (depth == 1 && angles == 0) level += c;
    if (c == '(' || c == '[' || c == '{') ++depth;
    if (c == '<' && i > 0 && std::isalnum(static_cast<unsigned char>(code[i - 1]))) ++angles;
  }
  return i;
}

/// The functions of a file, by name, with the greatest number of their parameters. Calls do not count: no type stands
/// before them, and no body, `;` or specifier of a declaration behind. Nor do variables: their arguments have no types.
std::map<std::string, std::size_t> parameters_in(const std::string& code) {
  static const std::regex begin(R"(([A-Za-z_][\w:]*|[&*>])\s+(\w+)\(|[&*](\w+)\()");
  static const std::regex statement(R"(return|else|new|throw|case|in)"),
      behind(R"(\s*(const|noexcept|override|[;{:]|->|=))");
  static const std::regex type_and_name(R"([\w>][\s&*]+\w)");
  std::map<std::string, std::size_t> result;
  for (auto match = std::sregex_iterator(code.begin(), code.end(), begin); match != std::sregex_iterator(); ++match) {
    if (std::regex_match((*match)[1].str(), statement)) continue;
    std::string level;
    const auto first = static_cast<std::size_t>(match->position() + match->length());
    const auto end = code.begin() + static_cast<std::ptrdiff_t>(end_of_bracket(code, first, level));
    if (!std::regex_search(end, code.end(), behind, std::regex_constants::match_continuous)) continue;
    if (!std::regex_search(level.substr(0, level.find(',')), type_and_name)) continue;
    const std::string name = (*match)[2].matched ? (*match)[2] : (*match)[3];
    std::size_t& most = result[name];
    most = std::max(most, static_cast<std::size_t>(std::count(level.begin(), level.end(), ',') + 1));
  }
  return result;
}

/// The classes of a file with the number of their members, whose names end in "_".
std::map<std::string, std::size_t> members_in(const std::string& code) {
  static const std::regex begin(R"(\bclass (\w+)[^;{(]*\{)"), member(R"(\b[a-z]\w*_\b)");
  std::map<std::string, std::size_t> result;
  for (auto match = std::sregex_iterator(code.begin(), code.end(), begin); match != std::sregex_iterator(); ++match) {
    std::string level;
    end_of_bracket(code, static_cast<std::size_t>(match->position() + match->length()), level);
    std::set<std::string> names;
    for (std::size_t first = 0, last; (last = level.find_first_of(";}", first)) != std::string::npos;
         first = last + 1) {
      const std::string statement = level.substr(first, last - first);
      if (statement.find('(') != std::string::npos) continue;
      for (auto name = std::sregex_iterator(statement.begin(), statement.end(), member); name != std::sregex_iterator();
           ++name)
        names.insert(name->str());
    }
    result[(*match)[1]] = names.size();
  }
  return result;
}

std::set<std::string> files() {
  std::set<std::string> result;
  for (const std::string& top : top_folders())
    for (const test::Line& line : lines_of(top)) result.insert(line.file);
  return result;
}

/// What belongs together stands in a struct.
TEST(Structure, FunctionsHaveAtMostSixParameters) {
  // In the innermost loops, structs of vectors would pass through memory.
  const std::set<std::string> vector_code{"bend_strongly", "add_spans"};
  std::set<std::string> found;
  for (const std::string& file : files())
    for (const auto& [name, count] : parameters_in(code_of(file))) {
      if (count <= 6) continue;
      EXPECT_TRUE(vector_code.count(name)) << file << ": " << name << " has " << count;
      found.insert(name);
    }
  EXPECT_EQ(found, vector_code);
}

/// A class has one task. Those with more members name the reason.
TEST(Structure, ClassesHaveAboutADozenMembers) {
  const std::map<std::string, std::size_t> larger{
      {"MeshCell", 17},          // The arrays that VTK's cells use again for each cell.
      {"WavelengthTracer", 16},  // The arrays of a batch of vertices, used again for each.
      {"Pages", 16},             // The state between two threads, under one lock.
      {"Rendering", 14},         // What all stages of one picture read.
  };
  constexpr std::size_t most = 13;
  for (const std::string& file : files())
    for (const auto& [name, count] : members_in(code_of(file))) {
      const auto exception = larger.find(name);
      EXPECT_LE(count, exception == larger.end() ? most : exception->second) << file << ": " << name;
      EXPECT_TRUE(exception == larger.end() || count > most) << name << " is no exception any more";
    }
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
    std::string level;
    const auto first = static_cast<std::size_t>(match->position() + match->length());
    const std::size_t end = code.find_first_not_of(" \n", end_of_bracket(code, first, level));
    if (end != std::string::npos && code[end] == mark) names.insert((*match)[1]);
  }
  return names;
}

std::string folder_of(const std::string& file) { return file.substr(0, file.rfind('/')); }

/// Otherwise two rooms may need each other without an include that shows it: only the linker would see the circle.
TEST(Structure, FunctionsAreDefinedInTheRoomThatDeclaresThem) {
  const std::set<std::string> replaced{"trace_in_packets"};  // The benchmark has another one, for comparison.
  std::map<std::string, std::set<std::string>> rooms;
  for (const std::string& file : files())
    if (file.substr(file.rfind('.')) == ".h")
      for (const std::string& name : free_functions(code_of(file), ';')) rooms[name].insert(folder_of(file));
  for (const std::string& file : files()) {
    if (file.substr(file.rfind('.')) == ".h") continue;
    const std::string of_targets = without(code_of(file), "HWY_BEFORE_NAMESPACE", "HWY_AFTER_NAMESPACE");
    for (const std::string& name : free_functions(without(of_targets, "namespace {\n", "\n}  \n"), '{'))
      EXPECT_TRUE(replaced.count(name) || !rooms.count(name) || rooms[name].count(folder_of(file)))
          << file << " defines " << name << ", which a header of another room declares";
  }
  EXPECT_TRUE(rooms.at("trace").count("integrators/tracing"));
}

TEST(Structure, ShapesAreCounted) {
  const std::string code =
      "class A final : public B {\n void f(int a, std::map<int, int> b, int c) const;\n int g() { return h(1, 2, 3, "
      "4); }"
      "\n int a_ = 1, b_;\n std::vector<int> c_{1, 2};\n};\n";
  EXPECT_EQ(parameters_in(code).at("f"), 3u);
  EXPECT_EQ(parameters_in(code).count("h"), 0u);
  EXPECT_EQ(members_in(code).at("A"), 3u);
  EXPECT_EQ(free_functions("\nint f(int a);\nvoid g() {}\n  int h();\n", ';'), std::set<std::string>{"f"});
}

}  // namespace
}  // namespace tensorray
