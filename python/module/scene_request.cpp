#include "python/module/scene_request.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "base/text/text.h"
#include "integrators/methods/read_scene.h"
#include "scenes/source/overrides.h"

namespace tensorray {
namespace {

/// Keys of `field` that say where its voxels come from.
constexpr const char* source_keys[] = {"file", "name", "generate", "derive"};

/// The scene with the keys of another field, and those of its own that say how a field is used.
Json with_field(const Json& scene, const Json& keys) {
  Json field = keys;
  if (const auto own = scene.find("field"); own != scene.end()) {
    if (!own->is_object()) return scene;  // The reader says what is wrong.
    Json uses = *own;
    for (const char* key : source_keys) uses.erase(key);
    field.update(uses);
  }
  if (scene.contains("field")) {
    Json changed = scene;
    changed["field"] = field;
    return changed;
  }
  Json changed = {{"field", field}};
  changed.update(scene);
  return changed;
}

Json json_of(const SceneRequest& request) {
  if (request.json.empty()) return scene_json(request.file, request.changes);
  Json json = parse_value(request.json);
  if (!json.is_object()) throw SceneError(request.file.string() + ": the scene must be an object (a dict)");
  for (const std::string& change : request.changes) apply_override(json, change);
  return json;
}

/// A name that selects a kind of output; no file of that name is made.
std::filesystem::path name_of(const std::string& key, const OutputDescription& output) {
  std::vector<std::string> known;
  for (const Output& kind : output.kinds) {
    if (key == kind.key) return "kept in memory" + kind.option_endings().front();
    known.emplace_back(kind.key);
  }
  throw std::invalid_argument("keep: unknown output `" + escaped(key) + "`; there are " + joined(known));
}

}  // namespace

RequestedScene read_request(const SceneRequest& request) {
  Json json = json_of(request);
  if (request.field) json = with_field(json, request.field->keys());
  RequestedScene scene;
  scene.description = read_scene_json(json, request.file, {{}, request.outputs, request.frame});
  if (!request.outputs.empty()) scene.files = scene.description.output.files;
  std::vector<std::filesystem::path> made = request.outputs;
  for (const std::string& key : request.keep)
    if (scene.files.count(key) == 0) made.push_back(name_of(key, scene.description.output));
  scene.description = read_scene_json(json, request.file, {{}, made, request.frame});
  return scene;
}

Scene load_request(const SceneRequest& request, const RequestedScene& scene, const Progress& progress) {
  if (!request.field) return load_scene(scene.description, progress);
  progress.update("loading", 0, 1);
  const SceneDescription& description = scene.description;
  return load_scene(description, progress, request.field->loaded(choices_of(description), description.turn()));
}

void add_scene_request(pybind11::module_& module) {
  pybind11::class_<SceneRequest>(module, "SceneRequest")
      .def(pybind11::init<std::filesystem::path, std::string, std::vector<std::string>, std::optional<int>,
                          std::shared_ptr<Field>, std::vector<std::filesystem::path>, std::vector<std::string>>());
}

}  // namespace tensorray
