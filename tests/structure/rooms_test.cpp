// The includes that are allowed between folders of sources ("rooms"): one line for each room.

#include <algorithm>
#include <filesystem>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/structure/sources.h"

namespace tensorray {
namespace {

using test::Line, test::lines_of, test::top_folders;

struct Room {
  std::string folder;
  std::vector<std::string> may_include;  ///< Rooms; "folder/*" is every room below a folder.
};

/// A room may also include itself and base. It may only include rooms above it in this table: then no includes form
/// a circle.
const std::vector<Room> rooms{
    {"base", {}},

    {"renderer/images", {}},
    {"renderer/sampling", {}},
    {"renderer/surfaces", {}},
    {"renderer/color", {"renderer/images"}},
    {"renderer/film", {"renderer/color", "renderer/images"}},
    {"renderer/materials", {"renderer/color", "renderer/sampling"}},
    {"renderer/textures", {"renderer/color", "renderer/images", "renderer/sampling"}},
    {"renderer/openimageio", {"renderer/images", "renderer/textures"}},
    {"renderer/lights", {"renderer/color", "renderer/sampling", "renderer/surfaces", "renderer/textures"}},
    {"renderer/shading",
     {"renderer/film", "renderer/lights", "renderer/materials", "renderer/sampling", "renderer/surfaces"}},

    {"volumes/grids", {}},
    {"volumes/bricks", {"volumes/grids"}},
    {"volumes/tensors", {"volumes/bricks", "volumes/grids"}},
    {"volumes/files", {"volumes/grids", "volumes/tensors"}},

    {"integrators/bending", {"renderer/*", "volumes/*"}},
    {"integrators/packets", {"integrators/bending", "renderer/*", "volumes/*"}},
    {"integrators/flow", {"integrators/bending", "renderer/*", "volumes/*"}},
    {"integrators/lens", {"integrators/bending", "integrators/flow", "renderer/*", "volumes/*"}},
    {"integrators/paths", {"integrators/bending", "renderer/*", "volumes/*"}},
    {"integrators/photons", {"integrators/bending", "renderer/*", "volumes/*"}},
    {"integrators/view", {"integrators/bending", "renderer/*", "volumes/*"}},
    {"integrators/probes", {"integrators/bending", "renderer/*", "volumes/*"}},

    {"scenes/keys", {"integrators/*", "renderer/*", "volumes/*"}},
    {"scenes/description", {"scenes/keys", "integrators/*", "renderer/*", "volumes/*"}},
    {"scenes/scene", {"scenes/description", "scenes/keys", "integrators/*", "renderer/*", "volumes/*"}},
    {"scenes/outputs",
     {"scenes/scene", "scenes/description", "scenes/keys", "integrators/*", "renderer/*", "volumes/*"}},
    {"scenes/jobs", {"scenes/scene", "scenes/description", "scenes/keys", "integrators/*", "renderer/*", "volumes/*"}},
    {"scenes/photons",
     {"scenes/outputs", "scenes/scene", "scenes/description", "scenes/keys", "integrators/*", "renderer/*",
      "volumes/*"}},
    {"scenes/lens",
     {"scenes/outputs", "scenes/scene", "scenes/description", "scenes/keys", "integrators/*", "renderer/*",
      "volumes/*"}},
    {"scenes/stretch",
     {"scenes/outputs", "scenes/scene", "scenes/description", "scenes/keys", "integrators/*", "renderer/*",
      "volumes/*"}},
    {"scenes/path_tracing",
     {"scenes/photons", "scenes/outputs", "scenes/scene", "scenes/description", "scenes/keys", "integrators/*",
      "renderer/*", "volumes/*"}},
    {"scenes/whole",
     {"scenes/path_tracing", "scenes/outputs", "scenes/scene", "scenes/description", "scenes/keys", "integrators/*",
      "renderer/*", "volumes/*"}},
    {"scenes/pipeline",
     {"scenes/photons", "scenes/lens", "scenes/stretch", "scenes/path_tracing", "scenes/whole", "scenes/description",
      "scenes/keys", "integrators/*", "renderer/*", "volumes/*"}},

    {"python/module", {"scenes/*", "integrators/*", "renderer/*", "volumes/*"}},

    {"tools/command_line", {}},
    {"tools/ranks", {}},
    {"tools/import/lattices", {"volumes/*"}},
    {"tools/import/meshes", {"tools/import/lattices", "volumes/*"}},
    {"tools/import/vtk", {"tools/import/lattices", "volumes/*"}},
    {"tools/import", {"tools/import/lattices", "tools/import/meshes", "tools/import/vtk", "volumes/*"}},
    {"tools/import/program", {"tools/import", "tools/import/vtk", "tools/command_line", "volumes/*"}},
    {"tools/viewer", {"scenes/*", "integrators/*", "renderer/*", "volumes/*"}},
    {"tools/viewer/program", {"tools/viewer", "tools/command_line", "renderer/*"}},
    {"tools/commands", {"tools/command_line", "tools/ranks", "scenes/*", "integrators/*", "renderer/*", "volumes/*"}},
    {"tools", {"tools/commands", "tools/command_line"}},
    {"tools/benchmark", {"tools/command_line", "tools/viewer", "scenes/*", "integrators/*", "renderer/*", "volumes/*"}},
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
  return folder == room.folder || folder == "base" ||
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

TEST(Structure, EveryRoomIsListed) {
  std::set<std::string> folders;
  for (const std::string& top : top_folders())
    for (const Line& line : lines_of(top)) folders.insert(line.folder());
  for (const std::string& folder : folders)
    EXPECT_TRUE(room_of(folder)) << folder << " is not listed: add a line to the table of " << __FILE__;
}

TEST(Structure, EveryListedRoomHasSources) {
  for (const Room& room : rooms) {
    const std::vector<Line> lines = lines_of(room.folder);
    const auto is_here = [&](const Line& line) { return line.folder() == room.folder; };
    EXPECT_TRUE(std::any_of(lines.begin(), lines.end(), is_here)) << room.folder << " is empty: remove its line";
  }
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
  for (const std::string& top : top_folders())
    for (const Line& line : lines_of(top)) {
      const std::optional<std::string> folder = included_folder(line);
      const Room* const room = room_of(line.folder());
      if (!folder || !room) continue;
      EXPECT_TRUE(may_include(*room, *folder))
          << line.file << ": " << line.text << ": " << room->folder << " may not include " << *folder;
    }
}

}  // namespace
}  // namespace tensorray
