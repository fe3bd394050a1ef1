#include "scenes/description/run_files.h"

#include <cstdlib>

#include <fmt/core.h>

#include "renderer/color/color.h"

namespace tensorray {

std::vector<NamedFile> input_files(const SceneDescription& scene) {
  std::vector<NamedFile> files;
  if (!is_device(scene.path)) files.push_back({scene.path, "the scene file"});  // A scene may come through a pipe.
  files.push_back({scene.field.file, "`/field/file`"});
  files.push_back({scene.field.bounds, "`/field/bounds`"});
  const char* const environment = std::getenv("OCIO");  // It counts only where the scene names no config.
  const bool is_own = !scene.output.ocio.empty();
  const std::string config = is_own ? scene.output.ocio : environment ? environment : "";
  if (!is_library_config(config)) files.push_back({config, is_own ? "`/output/ocio`" : "$OCIO"});
  if (const auto* spectrum = std::get_if<std::filesystem::path>(&scene.light.spectrum))
    files.push_back({*spectrum, "`/light/spectrum`"});
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i)
    files.push_back({scene.obstacles[i], fmt::format("`/obstacles/{}/file`", i)});
  for (std::size_t i = 0; i < scene.lights.size(); ++i)
    files.push_back({scene.lights[i].file, fmt::format("`/lights/{}/file`", i)});
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    files.push_back({scene.objects[i].file, fmt::format("`/objects/{}/file`", i)});
    if (const auto* picture = std::get_if<std::filesystem::path>(&scene.objects[i].texture))
      files.push_back({*picture, fmt::format("`/objects/{}/texture`", i)});
  }
  for (const auto& method : scene.integrator.methods)
    for (NamedFile& file : method->inputs()) files.push_back(std::move(file));
  return files;
}

std::vector<NamedFile> output_files(const SceneDescription& scene) {
  std::vector<NamedFile> files;
  for (const auto& [key, file] : scene.output.files) files.push_back({file, "`/output/" + key + "`"});
  return files;
}

void check_files(const SceneDescription& scene, const std::vector<NamedFile>& more,
                 const std::vector<NamedFile>& read) {
  std::vector<NamedFile> outputs = output_files(scene);
  outputs.insert(outputs.end(), more.begin(), more.end());
  try {
    std::vector<NamedFile> inputs = input_files(scene);
    inputs.insert(inputs.end(), read.begin(), read.end());
    require_distinct_files(inputs, outputs);
  } catch (const std::invalid_argument& error) {
    throw SceneError(printable(scene.path.string() + ": " + error.what()));
  }
}

}  // namespace tensorray
