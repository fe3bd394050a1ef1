#pragma once
/// Scene file → SceneDescription. Reads no other file.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scenes/description/description.h"

namespace tensorray {

/// A description with the defaults of all methods, which methods.cpp lists. A scene file is then read into it.
SceneDescription default_scene();

/// Changes to a scene file from the command line.
struct SceneChanges {
  /// "KEY=VALUE". KEY is a list of keys with dots between them ("light.photons", "obstacles.0.file"). VALUE is JSON; if
  /// it is not valid JSON, it is a string. Overrides are applied in order, before anything is checked. The value null
  /// removes a key. An index one past the end of a list appends an item.
  std::vector<std::string> overrides;

  /// Files to write instead of the scene's, relative to the working folder; their endings select the method's outputs.
  std::vector<std::filesystem::path> outputs;

  /// The frame of a scene that changes (set_frame); # in `outputs` is its number, too. None: no keyframes are allowed.
  std::optional<int> frame = std::nullopt;

  /// The field that was made of the file, which is another program's; empty: the file is a scene or a field.
  std::filesystem::path imported = {};
};

/// Whether a path names a field, an OpenVDB file, and not a scene.
bool is_field_file(const std::filesystem::path& path);

/// Reads a scene file: JSON with comments; of a field's file, which is not opened, it makes a scene of defaults.
/// Relative paths in it are relative to the scene file's folder. Without outputs, `image` and `exr` have its name.
/// @throw SceneError: the file is unreadable or not JSON; a key is unknown (with the nearest valid one), missing, of
/// the wrong type or out of range; two keys exclude each other.
SceneDescription read_scene(const std::filesystem::path& path, const SceneChanges& changes = {});

/// The first step of read_scene: the scene as JSON, with `overrides` applied, and otherwise unchecked.
Json scene_json(const std::filesystem::path& path, const std::vector<std::string>& overrides = {},
                bool is_imported = false);

/// The other step: JSON → SceneDescription. @param changes  Its overrides have no effect.
SceneDescription read_scene_json(Json json, const std::filesystem::path& path, const SceneChanges& changes = {});

/// Paths in a scene are relative to its folder. @param copy  Of the scene; empty: there is none.
/// @throw SceneError if it is in another folder; that of a field has no relative paths.
void require_same_folder(const std::filesystem::path& scene, const std::filesystem::path& copy);

/// Whether numbers may have keyframes, as in a scene of which frames are rendered.
enum class SchemaKind { one_frame, with_keyframes };

/// The JSON Schema (draft 2020-12) of scene files, made from the same tables of keys that read_scene uses.
std::string scene_schema(SchemaKind kind = SchemaKind::one_frame);

}  // namespace tensorray
