#include "integrators/methods/read_scene.h"

#include <algorithm>
#include <cstring>

#include <fmt/core.h>

#include "base/text/path_text.h"
#include "base/text/text.h"
#include "scenes/description/check_scene.h"
#include "scenes/description/scene_keys.h"
#include "scenes/keys/section_reader.h"
#include "scenes/source/overrides.h"

namespace tensorray {
namespace {

/// The kind with the longest matching ending; null if no ending matches.
const Output* best_kind(const std::filesystem::path& file, const std::vector<Output>& kinds) {
  const auto best = std::max_element(kinds.begin(), kinds.end(), [&](const Output& a, const Output& b) {
    return a.ending_of(file).size() < b.ending_of(file).size();
  });
  return best->ending_of(file).empty() ? nullptr : &*best;
}

[[noreturn]] void refuse_ending(const std::filesystem::path& file, const std::vector<Output>& kinds,
                                const Method& method) {
  std::vector<std::string> known;
  for (const Output& kind : kinds)
    for (const std::string& ending : kind.option_endings()) known.push_back(ending);
  throw SceneError(
      printable(fmt::format("-o {}: unknown ending; {} can write {}", file.string(), method.name(), joined(known))));
}

/// Replaces the output files of the scene by those of the command line. A file that only another method makes is kept
/// here; check_scene reports it, as it does for files of the scene.
void replace_outputs(SceneDescription& scene, const std::vector<std::filesystem::path>& outputs) {
  if (outputs.empty()) return;
  scene.output.files.clear();
  const Method& method = scene.integrator.method();
  const std::vector<Output> made = method.outputs();
  for (const std::filesystem::path& file : outputs) {
    const Output* kind = best_kind(file, made);
    if (!kind) kind = best_kind(file, scene.output.kinds);
    if (!kind) refuse_ending(file, made, method);
    const auto [other, is_new] = scene.output.files.emplace(kind->key, std::filesystem::absolute(file));
    if (!is_new)
      throw SceneError(printable(fmt::format("-o: {} and {} are of one kind; give one of them",
                                             other->second.filename().string(), file.string())));
  }
}

void choose_outputs(SceneDescription& scene, const std::optional<int>& frame) {
  if (!scene.output.files.empty()) return;
  const std::string name = std::filesystem::path(scene.path).replace_extension().string();
  const std::string number = frame ? numbered(".####", *frame) : "";
  scene.output.files["image"] = name + number + ".png";
  scene.output.files["exr"] = name + number + ".exr";
}

/// The scene of a field alone: the light that it bends, on a plate, from the side that shows most.
Json scene_of_field(const std::filesystem::path& field) {
  return {{"field", {{"file", text_of_path(std::filesystem::absolute(field))}}},
          {"light", {{"direction", "auto"}}},
          {"integrator", {{"type", "photon_distribution"}}}};
}

}  // namespace

bool is_field_file(const std::filesystem::path& path) { return path.extension() == ".vdb"; }

Json scene_json(const std::filesystem::path& path, const std::vector<std::string>& overrides, bool is_imported) {
  Json json = is_imported || is_field_file(path) ? scene_of_field(path) : read_json_object(path);
  for (const std::string& change : overrides) apply_override(json, change);
  return json;
}

SceneDescription read_scene(const std::filesystem::path& path, const SceneChanges& changes) {
  return read_scene_json(scene_json(path, changes.overrides, !changes.imported.empty()), path, changes);
}

SceneDescription read_scene_json(Json json, const std::filesystem::path& path, const SceneChanges& changes) {
  SceneSource source{path};
  source.is_y_up = given(json, "/world/up") && json["world"]["up"] == "y";
  std::vector<std::filesystem::path> outputs = changes.outputs;
  if (changes.frame) {
    set_frame(json, *changes.frame, source);
    for (std::filesystem::path& output : outputs) output = numbered(output.string(), *changes.frame);
  } else {
    refuse_keyframes(json, source);
  }
  SceneDescription scene = default_scene();
  scene.path = path;
  scene.text = json.dump();
  SectionReader reader(json, "", source);
  describe(scene, reader);
  reader.finish();
  scene.field.imported = changes.imported;
  scene.output.caption = with_values(scene.output.caption, json, source);
  replace_outputs(scene, outputs);
  choose_outputs(scene, changes.frame);
  check_scene(scene, json, source);
  return scene;
}

void require_same_folder(const std::filesystem::path& scene, const std::filesystem::path& copy) {
  if (copy.empty() || is_field_file(scene)) return;
  const auto folder = [](const std::filesystem::path& file) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(file).parent_path());
  };
  if (folder(scene) != folder(copy))
    throw SceneError(
        printable(fmt::format("--save-scene {}: must be in the folder of {}, to which paths in it are "
                              "relative",
                              copy.string(), scene.string())));
}

std::string scene_schema(SchemaKind kind) {
  SceneDescription scene = default_scene();
  SchemaWriter writer;
  describe(scene, writer);
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", "tensorray scene"}};
  schema.update(writer.finish("What tensorray renders. Lengths are in the field's world units, wavelengths in nm."));
  if (kind == SchemaKind::with_keyframes) allow_keyframes(schema);
  return schema.dump(2);
}

}  // namespace tensorray
