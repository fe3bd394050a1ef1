#include "scenes/read_scene.h"

#include "scenes/check_scene.h"
#include "scenes/json_reader.h"
#include "scenes/overrides.h"
#include "scenes/scene_source.h"
#include "scenes/section_reader.h"

namespace tensorray {
namespace {

void choose_outputs(SceneDescription& scene) {
  OutputDescription& output = scene.output;
  const bool named = !output.image.empty() || !output.exr.empty() || !output.spectral.empty() ||
                     !output.photons.empty() || !output.paths.empty() || !output.tubes.empty() ||
                     !output.fluence.empty();
  if (named) return;
  output.image = std::filesystem::path(scene.path).replace_extension(".png");
  output.exr = std::filesystem::path(scene.path).replace_extension(".exr");
}

}  // namespace

SceneDescription read_scene(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  Json json = read_json_object(path);
  for (const std::string& change : overrides) apply_override(json, change);

  const SceneSource source{path};
  SceneDescription scene;
  scene.path = path;
  scene.text = json.dump();
  SectionReader reader(json, "", source);
  describe(scene, reader);
  reader.finish();
  choose_outputs(scene);
  check_scene(scene, json, source);
  return scene;
}

}  // namespace tensorray
