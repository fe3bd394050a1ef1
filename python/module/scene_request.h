#pragma once
/// @file python/module/scene_request.h
/// A scene as Python asks for it, and words of scene files as arguments.

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "python/module/field.h"
#include "scenes/description/choices.h"
#include "scenes/description/description.h"
#include "scenes/keys/values.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// Python fills it.
struct SceneRequest {
  std::filesystem::path file;        ///< The scene's file, or a field's; without `json`, it is read.
  std::string json;                  ///< The scene itself. Relative paths are relative to the folder of `file`.
  std::vector<std::string> changes;  ///< "KEY=VALUE", as SceneChanges::overrides.
  std::optional<int> frame;          ///< Of a scene with keyframes.
  std::shared_ptr<Field> field;      ///< Replaces the scene's own field; null: the scene has one.
  std::vector<std::filesystem::path> outputs;  ///< Files that are written.
  std::vector<std::string> keep;               ///< Kinds of output, by key, that are made but not written.
};

struct RequestedScene {
  SceneDescription description;                        ///< Its output files are all that is made.
  std::map<std::string, std::filesystem::path> files;  ///< Those of them that are written, by the key of their output.
};

/// Reads and checks the scene. @throw SceneError; std::invalid_argument.
RequestedScene read_request(const SceneRequest& request);

/// Loads it. @throw as load_scene.
Scene load_request(const SceneRequest& request, const RequestedScene& scene, const Progress& progress);

/// The value of a word, as scene files have it. @throw std::invalid_argument that lists the words.
template <class Enum>
Enum value_of(const std::string& argument, const std::string& word) {
  Enum value{};
  if (!Value<Enum>::read(Json(word), {}, value))
    throw std::invalid_argument(argument + " must be " + Value<Enum>::expectation(value, {}));
  return value;
}

}  // namespace tensorray
