#pragma once
/// @file python/module/scene_request.h
/// A scene as Python asks for it.

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "python/module/field.h"
#include "scenes/description/description.h"
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

/// Adds SceneRequest to the module.
void add_scene_request(pybind11::module_& module);

}  // namespace tensorray
