// The rules of ARCHITECTURE.md that a machine can check, on the sources themselves.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace {

const std::filesystem::path root = TENSORRAY_SOURCE_DIR;

/// What each folder may include, besides itself.
const std::map<std::string, std::set<std::string>> allowed{
    {"base", {}},
    {"renderer", {"base"}},
    {"volumes", {"base"}},
    {"integrators", {"base", "renderer", "volumes"}},
    {"scenes", {"base", "integrators", "renderer", "volumes"}},
    {"tools", {"base", "scenes", "integrators", "renderer", "volumes"}},
};

struct Line {
  std::string file, text;
};

/// All lines of the sources in a folder.
std::vector<Line> lines_of(const std::string& folder) {
  std::vector<Line> lines;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
    const std::string ending = entry.path().extension().string();
    if (ending != ".h" && ending != ".cpp") continue;
    std::ifstream file(entry.path());
    const std::string name = std::filesystem::relative(entry.path(), root).string();
    for (std::string text; std::getline(file, text);) lines.push_back({name, text});
  }
  EXPECT_GT(lines.size(), 100u) << "no sources in " << folder;
  return lines;
}

TEST(Structure, NothingIncludesUpwards) {
  const std::regex include("^#include \"([a-z]+)/");
  for (const auto& [folder, others] : allowed)
    for (const Line& line : lines_of(folder)) {
      std::smatch match;
      if (!std::regex_search(line.text, match, include)) continue;
      EXPECT_TRUE(match[1] == folder || others.count(match[1])) << line.file << ": " << line.text;
    }
}

/// The benchmark measures against these libraries' own samplers.
bool is_benchmark(const Line& line) { return line.file.rfind("tools/benchmark/", 0) == 0; }

TEST(Structure, HeavyLibrariesStayOutOfHeadersAndInTheirFolder) {
  const std::map<std::string, std::string> homes{{"openvdb", "volumes"},
                                                 {"embree", "renderer"},
                                                 {"OpenImageIO", "renderer"},
                                                 {"OpenColorIO", "renderer"},
                                                 {"assimp", "renderer"}};
  const std::regex include("#include <(openvdb|embree|OpenImageIO|OpenColorIO|assimp)");
  std::map<std::string, std::set<std::string>> users;
  for (const auto& [folder, others] : allowed)
    for (const Line& line : lines_of(folder)) {
      std::smatch match;
      if (!std::regex_search(line.text, match, include) || is_benchmark(line)) continue;
      EXPECT_EQ(homes.at(match[1]), folder) << line.file;
      users[match[1]].insert(line.file);
      // Included by two .cpp of the same folder.
      const bool private_header =
          line.file == "volumes/files/vdb_archive.h" || line.file == "renderer/surfaces/embree_handles.h";
      EXPECT_TRUE(private_header || line.file.substr(line.file.size() - 2) != ".h") << line.file << ": " << line.text;
    }
  const std::map<std::string, std::set<std::string>> only{
      {"embree", {"renderer/surfaces/embree_handles.h"}},
      {"OpenImageIO", {"renderer/images/image.cpp", "renderer/textures/texture.cpp"}},
      {"OpenColorIO", {"renderer/color/color.cpp"}},
      {"assimp", {"renderer/surfaces/mesh.cpp"}}};
  for (const auto& [library, files] : only) EXPECT_EQ(users[library], files) << library;
}

/// So that rendering needs none of these libraries.
TEST(Structure, ForeignFormatsStayInTheImporter) {
  const std::regex include("#include <(vtk|teem|nifti|nrrd)");
  for (const auto& [folder, others] : allowed)
    for (const Line& line : lines_of(folder)) {
      if (!std::regex_search(line.text, include) || is_benchmark(line)) continue;
      EXPECT_EQ(line.file.rfind("tools/import/", 0), 0u) << line.file << ": " << line.text;
    }
}

TEST(Structure, RoomsOfTheImporterIncludeOneWay) {
  const std::map<std::string, std::set<std::string>> rooms{
      {"lattices", {"lattices"}}, {"meshes", {"lattices", "meshes"}}, {"vtk", {"lattices", "vtk"}}};
  const std::regex include("#include \"tools/import/([a-z]+)/");
  for (const auto& [room, others] : rooms)
    for (const Line& line : lines_of("tools/import/" + room)) {
      std::smatch match;
      if (!std::regex_search(line.text, match, include)) continue;
      EXPECT_TRUE(others.count(match[1])) << line.file << ": " << line.text;
    }
}

TEST(Structure, LibrariesNeitherPrintNorExit) {
  const std::regex forbidden(R"(std::(cout|cerr|clog|exit|abort|quick_exit)\b|\b(printf|puts|perror)\(|fmt::print)");
  for (const auto& [folder, others] : allowed) {
    // Of the tools, the importer is a library, but for its program.
    for (const Line& line : lines_of(folder == "tools" ? "tools/import" : folder)) {
      if (line.file.rfind("tools/import/program/", 0) == 0) continue;
      EXPECT_FALSE(std::regex_search(line.text, forbidden)) << line.file << ": " << line.text;
    }
  }
}

TEST(Structure, OnlyBendingKnowsTheRule) {
  for (const Line& line : lines_of("integrators")) {
    // Seeds only look at the field.
    if (line.file.rfind("integrators/bending", 0) == 0 || line.file.rfind("integrators/scalar_tracer", 0) == 0 ||
        line.file == "integrators/paths/threshold_seeds.cpp")
      continue;
    EXPECT_EQ(line.text.find("TensorSampler"), std::string::npos) << line.file << ": " << line.text;
  }
}

TEST(Structure, IntegratorsNeverSeeAScene) {
  for (const Line& line : lines_of("integrators"))
    EXPECT_EQ(line.text.find("SceneDescription"), std::string::npos) << line.file << ": " << line.text;
}

}  // namespace
