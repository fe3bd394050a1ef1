#pragma once
/// @file scenes/pipeline/read_scene.h
/// Scene file → SceneDescription. Touches no other file.

#include <filesystem>
#include <string>
#include <vector>

#include "scenes/description/description.h"

namespace tensorray {

/// What the command line says of a scene beside the scene file.
struct SceneChanges {
  /// "KEY=VALUE", KEY a dotted path ("light.photons", "obstacles.0.file"), VALUE JSON or, where it is not JSON, a
  /// string. Applied in order, before anything is checked; null removes a key, an index one past the end of a list
  /// appends.
  std::vector<std::string> overrides;

  /// Files to write instead of the scene's, relative to the working folder. The ending says which of the method's
  /// outputs each one is.
  std::vector<std::filesystem::path> outputs;
};

/// Reads a scene file: JSON, comments allowed. Relative paths come out relative to the scene file's folder.
/// Where no output file is named, `image` and `exr` are the scene file's name with .png and .exr, beside it.
/// @throw SceneError: unreadable, not JSON, a key unknown (with the nearest valid one), missing, of the wrong type or
/// out of range, or two keys that exclude each other.
SceneDescription read_scene(const std::filesystem::path& path, const SceneChanges& changes = {});

/// The JSON Schema (draft 2020-12) of scene files, made from the same tables of keys that read_scene uses.
std::string scene_schema();

}  // namespace tensorray
