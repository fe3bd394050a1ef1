#pragma once
/// @file scenes/read_scene.h
/// Scene file → SceneDescription. Touches no other file.

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "scenes/description.h"

namespace tensorray {

/// The scene file is wrong. The message is one line: what, where (file and JSON pointer, or line and column), the mend.
struct SceneError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads a scene file: JSON, comments allowed. Relative paths come out relative to the scene file's folder.
/// @param overrides  "KEY=VALUE", KEY a dotted path ("light.photons", "obstacles.0.file"), VALUE JSON or, where it is
/// not JSON, a string. Applied in order, before anything is checked; null removes a key, an index one past the end of
/// a list appends.
/// Where no output file is named, `image` and `exr` are the scene file's name with .png and .exr, beside it.
/// @throw SceneError: unreadable, not JSON, a key unknown (with the nearest valid one), missing, of the wrong type or
/// out of range, or two keys that exclude each other.
SceneDescription read_scene(const std::filesystem::path& path, const std::vector<std::string>& overrides = {});

/// The JSON Schema (draft 2020-12) of scene files, made from the same table of keys that read_scene uses.
std::string scene_schema();

}  // namespace tensorray
