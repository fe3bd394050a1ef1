// The includes that are allowed between folders of sources ("rooms"): one line for each room.

#include <map>
#include <optional>
#include <regex>
#include <set>

#include "tests/structure/sources.h"

namespace tensorray {
namespace {

using test::all_lines, test::Line;

struct Room {
  std::string folder;
  std::vector<std::string> may_include;  ///< Rooms; "folder/*" is every room below a folder.
};

/// A room may also include itself, and all rooms of base if it is none of these. It may only include rooms above it in
/// this table: then no includes form a circle.
const std::vector<Room> rooms{
    {"base", {}},
    {"base/text", {"base"}},
    {"base/files", {"base", "base/text"}},
    {"base/geometry", {"base", "base/files", "base/text"}},
    {"base/process", {"base", "base/files", "base/text"}},

    {"renderer/images", {}},
    {"renderer/sampling", {}},
    {"renderer/spectra", {}},
    {"renderer/surfaces", {}},
    {"renderer/coverage", {"renderer/surfaces"}},
    {"renderer/meshes", {}},
    {"renderer/color", {"renderer/images"}},
    {"renderer/charts", {"renderer/images"}},
    {"renderer/film", {"renderer/images", "renderer/spectra"}},
    {"renderer/density", {"renderer/film"}},
    {"renderer/materials", {"renderer/sampling", "renderer/spectra"}},
    {"renderer/textures", {"renderer/charts", "renderer/color", "renderer/images", "renderer/sampling"}},
    {"renderer/openimageio", {"renderer/images", "renderer/textures"}},
    {"renderer/lights", {"renderer/sampling", "renderer/spectra", "renderer/surfaces", "renderer/textures"}},
    {"renderer/light_maps", {"renderer/lights", "renderer/surfaces"}},
    {"renderer/shading",
     {"renderer/light_maps", "renderer/lights", "renderer/materials", "renderer/sampling", "renderer/surfaces"}},
    {"renderer/camera", {"renderer/film", "renderer/shading", "renderer/surfaces"}},

    {"volumes/grids", {}},
    {"volumes/bricks", {"volumes/grids"}},
    {"volumes/sampling", {"volumes/bricks"}},
    {"volumes/tensors", {"volumes/bricks", "volumes/grids", "volumes/sampling"}},
    {"volumes/making", {"volumes/bricks", "volumes/grids", "volumes/sampling", "volumes/tensors"}},
    {"volumes/vdb", {"volumes/grids"}},
    {"volumes/points", {"volumes/vdb"}},
    {"volumes/files", {"volumes/grids", "volumes/tensors", "volumes/vdb"}},

    {"tracing/bending", {"renderer/*", "volumes/*"}},
    {"tracing/steps", {"tracing/bending", "renderer/*", "volumes/*"}},
    {"tracing/kernels", {"tracing/bending", "tracing/steps", "renderer/*", "volumes/*"}},
    {"tracing/trace", {"tracing/bending", "tracing/kernels", "tracing/steps", "renderer/*", "volumes/*"}},
    {"tracing/scale", {"tracing/bending", "tracing/trace", "renderer/*", "volumes/*"}},
    {"tracing/flow", {"tracing/bending", "tracing/trace", "renderer/*", "volumes/*"}},
    {"tracing/flow_drawing", {"tracing/bending", "tracing/flow", "tracing/trace", "renderer/*", "volumes/*"}},
    {"tracing/paths", {"tracing/bending", "tracing/steps", "tracing/trace", "renderer/*", "volumes/*"}},

    {"scenes/keys", {"tracing/*", "renderer/*", "volumes/*"}},
    {"scenes/source", {"scenes/keys", "tracing/*", "renderer/*", "volumes/*"}},
    {"scenes/description", {"scenes/keys", "tracing/*", "renderer/*", "volumes/*"}},
    {"scenes/scene", {"scenes/description", "tracing/*", "renderer/*", "volumes/*"}},
    {"scenes/outputs", {"scenes/scene", "scenes/description", "tracing/*", "renderer/*", "volumes/*"}},
    {"scenes/jobs", {"scenes/scene", "scenes/description", "scenes/keys", "tracing/*", "renderer/*", "volumes/*"}},

    {"integrators/path_files", {"tracing/*", "renderer/*", "volumes/*"}},
    {"integrators/seeds", {"renderer/*", "volumes/*"}},
    {"integrators/photon_distribution", {"scenes/*", "tracing/*", "renderer/*", "volumes/*"}},
    {"integrators/lens", {"scenes/*", "tracing/*", "renderer/*", "volumes/*"}},
    {"integrators/stretch", {"scenes/*", "tracing/*", "renderer/*", "volumes/*"}},
    {"integrators/polariscope", {"scenes/*", "tracing/*", "renderer/*", "volumes/*"}},
    {"integrators/path_tracing",
     {"integrators/path_files", "integrators/photon_distribution", "integrators/seeds", "scenes/*", "tracing/*",
      "renderer/*", "volumes/*"}},
    {"integrators/scene", {"integrators/path_tracing", "scenes/*", "tracing/*", "renderer/*", "volumes/*"}},
    {"integrators/methods",
     {"integrators/photon_distribution", "integrators/lens", "integrators/stretch", "integrators/polariscope",
      "integrators/path_tracing", "integrators/scene", "scenes/*", "tracing/*", "renderer/*", "volumes/*"}},

    {"python/module", {"integrators/*", "scenes/*", "tracing/*", "renderer/*", "volumes/*"}},

    {"tools/command_line", {}},
    {"tools/ranks", {}},
    {"tools/import/lattices", {"volumes/*"}},
    {"tools/import/lattice_files", {"tools/import/lattices", "volumes/*"}},
    {"tools/import/meshes", {"tools/import/lattices", "volumes/*"}},
    {"tools/import/surfaces", {"tools/import/meshes", "volumes/*"}},
    {"tools/import/sampling", {"tools/import/meshes", "volumes/*"}},
    {"tools/import/vtk", {"tools/import/lattices", "tools/import/meshes", "volumes/*"}},
    {"tools/import/vtk_formats", {"tools/import/lattices", "tools/import/vtk", "volumes/*"}},
    {"tools/import/cases", {"tools/import/meshes", "tools/import/vtk", "tools/import/vtk_formats", "volumes/*"}},
    {"tools/import/hdf5", {"tools/import/vtk", "volumes/*"}},
    {"tools/import/vtk_source",
     {"tools/import/cases", "tools/import/hdf5", "tools/import/meshes", "tools/import/vtk", "tools/import/vtk_formats",
      "volumes/*"}},
    {"tools/import",
     {"tools/import/cases", "tools/import/lattice_files", "tools/import/lattices", "tools/import/meshes",
      "tools/import/sampling", "tools/import/surfaces", "tools/import/vtk", "tools/import/vtk_formats",
      "tools/import/vtk_source", "volumes/*"}},
    {"tools/import/program", {"tools/import", "tools/import/vtk_formats", "tools/command_line", "volumes/*"}},
    {"tools/viewer", {"integrators/*", "scenes/*", "tracing/*", "renderer/*", "volumes/*"}},
    {"tools/viewer/server", {"tools/viewer"}},
    {"tools/viewer/program",
     {"tools/viewer", "tools/viewer/server", "tools/command_line", "integrators/methods", "renderer/*"}},
    {"tools/rendering",
     {"tools/command_line", "tools/ranks", "integrators/*", "scenes/*", "tracing/*", "renderer/*", "volumes/*"}},
    {"tools/commands",
     {"tools/rendering", "tools/command_line", "tools/ranks", "integrators/*", "scenes/*", "tracing/*", "renderer/*",
      "volumes/*"}},
    {"tools", {"tools/commands", "tools/command_line", "renderer/meshes"}},
    {"tools/benchmark", {"tools/viewer", "integrators/*", "scenes/*", "tracing/*", "renderer/*", "volumes/*"}},
};

/// Whether `name`, an item of `may_include`, means the room `folder`.
bool is_meant(const std::string& folder, const std::string& name) {
  if (name.back() != '*') return folder == name;
  return folder.compare(0, name.size() - 1, name, 0, name.size() - 1) == 0;
}

const Room* room_of(const std::string& folder) {
  const auto room = std::find_if(rooms.begin(), rooms.end(), [&](const Room& r) { return r.folder == folder; });
  return room == rooms.end() ? nullptr : &*room;
}

bool may_include(const Room& room, const std::string& folder) {
  const auto allows = [&](const std::string& other) { return is_meant(folder, other); };
  return folder == room.folder || (is_meant(folder, "base*") && !is_meant(room.folder, "base*")) ||
         std::any_of(room.may_include.begin(), room.may_include.end(), allows);
}

/// The folder of the file that a line includes in quotation marks; such files belong to this project. Sources that use
/// Highway name themselves in a macro, which includes them again.
std::optional<std::string> included_folder(const Line& line) {
  static const std::regex include("^ *# *(?:include|define HWY_TARGET_INCLUDE) *\"([^\"]*)\"");
  std::smatch match;
  if (!std::regex_search(line.text, match, include)) return std::nullopt;
  return std::filesystem::path(match[1].str()).parent_path().string();
}

TEST(Structure, RoomsAreThoseOfTheTable) {
  std::set<std::string> folders;
  for (const Line& line : all_lines()) folders.insert(line.folder());
  for (const std::string& folder : folders)
    EXPECT_TRUE(room_of(folder)) << folder << " is not listed: add a line to the table of " << __FILE__;
  for (const Room& room : rooms) EXPECT_TRUE(folders.count(room.folder)) << room.folder << " is empty: remove its line";
}

/// This makes circles of includes impossible.
TEST(Structure, RoomsStandBelowWhatTheyInclude) {
  for (auto room = rooms.begin(); room != rooms.end(); ++room)
    for (const std::string& other : room->may_include) {
      const auto is_other = [&](const Room& r) { return is_meant(r.folder, other); };
      EXPECT_TRUE(std::any_of(rooms.begin(), room, is_other)) << room->folder << ": no room above it is " << other;
      EXPECT_TRUE(std::none_of(room, rooms.end(), is_other)) << room->folder << " must stand below " << other;
    }
}

TEST(Structure, NothingIncludesUpwards) {
  for (const Line& line : all_lines()) {
    const std::optional<std::string> folder = included_folder(line);
    const Room* const room = room_of(line.folder());
    EXPECT_TRUE(!folder || !room || may_include(*room, *folder))
        << line.file << ": " << line.text << ": " << line.folder() << " may not include " << *folder;
  }
}

/// A room is read at one sitting: it has about a dozen files.
TEST(Structure, RoomsHaveAboutADozenFiles) {
  constexpr std::size_t most = 14;
  std::map<std::string, std::set<std::string>> files;
  for (const Line& line : all_lines()) files[line.folder()].insert(line.file);
  for (const auto& [folder, names] : files) EXPECT_LE(names.size(), most) << folder;
}

/// The tests of a library are in folders of the same names as its rooms.
TEST(Structure, TestsStandInRoomsOfTheSameNames) {
  for (const std::filesystem::path library : {"base", "integrators", "renderer", "tracing", "volumes", "tools/import"})
    for (const auto& entry : std::filesystem::directory_iterator(test::source_folder() / "tests" / library.filename()))
      EXPECT_TRUE(!entry.is_directory() || room_of(library / entry.path().filename()))
          << entry.path() << " has no room";
}

}  // namespace
}  // namespace tensorray
