// Which sources may use which libraries, and other invariants of ARCHITECTURE.md.

#include <map>
#include <regex>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "tests/structure/sources.h"

namespace tensorray {
namespace {

using test::Line, test::lines_of, test::top_folders;

/// The benchmark may include these libraries, because it compares with their samplers.
bool is_benchmark(const Line& line) { return line.is_under("tools/benchmark"); }

TEST(Structure, HeavyLibrariesStayOutOfHeadersAndInTheirFolder) {
  const std::map<std::string, std::string> homes{
      {"openvdb", "volumes"},      {"embree", "renderer"},  {"OpenImageIO", "renderer"},
      {"OpenColorIO", "renderer"}, {"OpenEXR", "renderer"}, {"png", "renderer"},
      {"assimp", "renderer"},      {"lcms2", "renderer"},   {"boost", "tools"}};
  const std::regex include("#include <(openvdb|embree|OpenImageIO|OpenColorIO|OpenEXR|png|assimp|lcms2|boost)");
  std::map<std::string, std::set<std::string>> users;
  for (const std::string& folder : top_folders())
    for (const Line& line : lines_of(folder)) {
      std::smatch match;
      if (!std::regex_search(line.text, match, include) || is_benchmark(line)) continue;
      EXPECT_EQ(homes.at(match[1]), folder) << line.file;
      users[match[1]].insert(line.file);
      // Private headers, which only .cpp files of the same folder include.
      const std::set<std::string> private_headers{"volumes/vdb/vdb_archive.h", "renderer/surfaces/embree_handles.h",
                                                  "tools/viewer/server/server_state.h"};
      const bool private_header = private_headers.count(line.file) > 0;
      EXPECT_TRUE(private_header || !line.is_of_header()) << line.file << ": " << line.text;
    }
  const std::map<std::string, std::set<std::string>> only{
      {"embree", {"renderer/surfaces/embree_handles.h"}},
      {"OpenImageIO", {"renderer/openimageio/picture_files.cpp"}},
      {"OpenColorIO", {"renderer/color/color.cpp"}},
      {"OpenEXR", {"renderer/images/exr.cpp"}},
      {"png", {"renderer/images/png.cpp"}},
      {"assimp", {"renderer/meshes/assimp_mesh.cpp"}},
      {"lcms2", {"renderer/color/file_colors.cpp"}},
      {"boost",
       {"tools/viewer/server/http_connection.cpp", "tools/viewer/server/page_socket.cpp",
        "tools/viewer/server/server_state.h"}}};
  for (const auto& [library, files] : only) EXPECT_EQ(users[library], files) << library;
}

/// So that rendering needs none of these libraries.
TEST(Structure, ForeignFormatsStayInTheImporter) {
  const std::regex include("#include <(vtk|teem|nifti|nrrd)");
  for (const std::string& folder : top_folders())
    for (const Line& line : lines_of(folder)) {
      if (!std::regex_search(line.text, include) || is_benchmark(line)) continue;
      EXPECT_TRUE(line.is_under("tools/import")) << line.file << ": " << line.text;
    }
}

/// So that programs start without MPI, and run where it is not installed.
TEST(Structure, OnlyALibraryOfItsOwnUsesMpi) {
  const std::regex include("#include <mpi");
  for (const std::string& folder : top_folders())
    for (const Line& line : lines_of(folder))
      EXPECT_FALSE(std::regex_search(line.text, include) && line.file != "tools/ranks/mpi_ranks.cpp") << line.file;
}

TEST(Structure, LibrariesNeitherPrintNorExit) {
  const std::regex forbidden(R"(std::(cout|cerr|clog|exit|abort|quick_exit)\b|\b(printf|puts|perror)\(|fmt::print)");
  // Among the tools, only the importer and the viewer are libraries, without their programs.
  const auto is_library = [](const Line& line) {
    return !line.is_under("tools") || (line.is_under("tools/import") && !line.is_under("tools/import/program")) ||
           (line.is_under("tools/viewer") && !line.is_under("tools/viewer/program"));
  };
  for (const std::string& folder : top_folders())
    for (const Line& line : lines_of(folder))
      EXPECT_FALSE(is_library(line) && std::regex_search(line.text, forbidden)) << line.file << ": " << line.text;
}

/// Eq. 5 needs the tensor at the position of a ray: from a sampler or, in packets, from the bricks.
TEST(Structure, OnlyBendingKnowsTheRule) {
  const std::regex tensor_at_a_point(R"(\b(TensorSampler|TensorBrick)\b|\bbrick\()");
  const std::set<std::string> rooms{"tracing/kernels", "tracing/steps", "tracing/trace"};
  std::set<std::string> readers;
  for (const Line& line : lines_of("tracing"))
    if (std::regex_search(line.text, tensor_at_a_point)) {
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
  for (const Line& line : lines_of("integrators")) {
    if (!std::regex_search(line.file, computes)) continue;
    ++found;
    EXPECT_FALSE(std::regex_search(line.text, includes)) << line.file << ": " << line.text;
  }
  EXPECT_GT(found, 1000u);
}

}  // namespace
}  // namespace tensorray
