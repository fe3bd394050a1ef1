// Which sources may use which libraries, and other invariants of ARCHITECTURE.md.

#include <cctype>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>

#include "tests/structure/sources.h"

namespace tensorray {
namespace {

using test::all_lines, test::Line;
using testing::Each, testing::MatchesRegex;
namespace fs = std::filesystem;

/// Each library is used in one place, and heavy ones stay out of headers that others include: rendering needs none of
/// the importer's, and programs start without MPI, and run where it is not installed.
TEST(Structure, LibrariesOfOthersStayInTheirPlace) {
  const std::regex include(
      "#include <(openvdb|embree|OpenImageIO|OpenColorIO|OpenEXR|png|assimp|lcms2|boost|vtk|teem|nifti|nrrd|mpi)");
  std::map<std::string, std::set<std::string>> users;
  for (const Line& line : all_lines()) {
    std::smatch match;
    if (std::regex_search(line.text, match, include)) users[match[1]].insert(line.file);
  }
  // The benchmark compares with the samplers of OpenVDB.
  EXPECT_THAT(users["openvdb"], Each(MatchesRegex("volumes/.*cpp|volumes/vdb/vdb_archive.h|tools/benchmark/.*cpp")));
  EXPECT_THAT(users["embree"], ElementsAre("renderer/surfaces/embree_handles.h"));
  EXPECT_THAT(users["OpenImageIO"], ElementsAre("renderer/openimageio/picture_files.cpp"));
  EXPECT_THAT(users["OpenColorIO"], ElementsAre("renderer/color/color.cpp"));
  EXPECT_THAT(users["OpenEXR"], ElementsAre("renderer/images/exr.cpp"));
  EXPECT_THAT(users["png"], ElementsAre("renderer/images/png.cpp"));
  EXPECT_THAT(users["assimp"], ElementsAre("renderer/meshes/assimp_mesh.cpp"));
  EXPECT_THAT(users["lcms2"], ElementsAre("renderer/color/file_colors.cpp"));
  EXPECT_THAT(users["boost"], ElementsAre("tools/viewer/server/http_connection.cpp",
                                          "tools/viewer/server/page_socket.cpp", "tools/viewer/server/server_state.h"));
  EXPECT_THAT(users["mpi"], ElementsAre("tools/ranks/mpi_ranks.cpp"));
  for (const char* library : {"vtk", "teem", "nifti", "nrrd"})
    EXPECT_THAT(users[library], Each(StartsWith("tools/import/"))) << library;
}

TEST(Structure, LibrariesNeitherPrintNorExit) {
  const std::regex forbidden(R"(std::(cout|cerr|clog|exit|abort|quick_exit)\b|\b(printf|puts|perror)\(|fmt::print)");
  // Among the tools, only the importer and the viewer are libraries, without their programs.
  const auto is_library = [](const Line& line) {
    return !line.is_under("tools") || (line.is_under("tools/import") && !line.is_under("tools/import/program")) ||
           (line.is_under("tools/viewer") && !line.is_under("tools/viewer/program"));
  };
  for (const Line& line : all_lines())
    EXPECT_FALSE(is_library(line) && std::regex_search(line.text, forbidden)) << line.file << ": " << line.text;
}

/// Eq. 5 needs the tensor at the position of a ray: from a sampler or, in packets, from the bricks.
TEST(Structure, OnlyBendingKnowsTheRule) {
  const std::regex tensor_at_a_point(R"(\b(TensorSampler|TensorBrick)\b|\bbrick\()");
  const std::set<std::string> rooms{"tracing/kernels", "tracing/steps", "tracing/trace"};
  std::set<std::string> readers;
  for (const Line& line : all_lines())
    if (line.is_under("tracing") && std::regex_search(line.text, tensor_at_a_point)) {
      EXPECT_TRUE(rooms.count(line.folder())) << line.file << ": " << line.text;
      readers.insert(line.folder());
    }
  // Both tracers must use the names that this test looks for.
  EXPECT_TRUE(readers.count("tracing/kernels") && readers.count("tracing/steps"));
}

/// Of a method, what loads and calls sees the scene; what computes does not.
TEST(Structure, WhatComputesNeverSeesAScene) {
  const std::regex includes("#include \"scenes/(scene/scene|description/description)\\.h\"");
  const std::regex computes(
      "/(lens|lens_map|lens_shading|lens_view|fluence|photon_chunks|photon_distribution|"
      "field_region|stretch|elements|differences|turning|polariscope)\\.(h|cpp)$");
  std::size_t found = 0;
  for (const Line& line : all_lines()) {
    if (!line.is_under("integrators") || !std::regex_search(line.file, computes)) continue;
    ++found;
    EXPECT_FALSE(std::regex_search(line.text, includes)) << line.file << ": " << line.text;
  }
  EXPECT_GT(found, 1000u);
}

// Functions are defined in the room of their declaration.
/// A file without comments, text and directives.
std::string code_of(const std::string& file) {
  const std::string text = bytes_of(test::source_folder() / file);
  std::string code;
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
  std::set<std::string> files;
  for (const Line& line : all_lines()) files.insert(line.file);
  std::map<std::string, std::set<std::string>> rooms;
  for (const std::string& file : files)
    if (file.substr(file.rfind('.')) == ".h")
      for (const std::string& name : free_functions(code_of(file), ';')) rooms[name].insert(folder_of(file));
  for (const std::string& file : files) {
    if (file.substr(file.rfind('.')) == ".h") continue;
    const std::string of_targets = without(code_of(file), "HWY_BEFORE_NAMESPACE", "HWY_AFTER_NAMESPACE");
    for (const std::string& name : free_functions(without(of_targets, "namespace {\n", "\n}  \n"), '{'))
      EXPECT_TRUE(!rooms.count(name) || rooms[name].count(folder_of(file)))
          << file << " defines " << name << ", which a header of another room declares";
  }
  EXPECT_TRUE(rooms.at("trace").count("tracing/trace"));
}

// The budgets of lines in CONTRIBUTING.md.
/// The lines of all sources by folder, for every folder above a source; "" is the whole project.
std::map<std::string, long> lines_by_folder() {
  const std::set<std::string> endings{".h", ".cpp", ".py", ".ts", ".css", ".html", ".inc"};
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

TEST(Budgets, AreKept) {
  const std::map<std::string, long> all = budgets();
  std::map<std::string, long> lines = lines_by_folder();
  for (const auto& [folder, budget] : all)
    EXPECT_LE(lines[folder], budget) << folder << " has more lines than its budget: CONTRIBUTING.md, Lines";
  for (const auto& [folder, count] : lines) {
    const bool is_top = !folder.empty() && folder.find('/') == std::string::npos;
    EXPECT_TRUE(!is_top || all.count(folder)) << folder << " has " << count << " lines and no budget";
  }
}

}  // namespace
}  // namespace tensorray
