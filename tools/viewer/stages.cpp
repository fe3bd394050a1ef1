#include "tools/viewer/stages.h"

#include <algorithm>

namespace tensorray {
namespace {

constexpr std::uint64_t min_positions = 1024;
constexpr int few_samples = 4;

Json pixels(const Eigen::Vector2i& resolution, int coarseness) {
  const Eigen::Vector2i coarse = ((resolution.array() + coarseness - 1) / coarseness).max(1).matrix();
  return {coarse.x(), coarse.y()};
}

/// The object below `key`, made if there is none.
Json& section(Json& json, const char* key) {
  Json& found = json[key];
  if (!found.is_object()) found = Json::object();
  return found;
}

}  // namespace

std::deque<Stage> stages_of(int coarseness, bool is_sampled) {
  std::deque<Stage> stages;
  if (coarseness > 1) stages.push_back({coarseness, 1});
  if (coarseness > 4) stages.push_back({4, few_samples});
  stages.push_back({1, is_sampled ? few_samples : 0});
  stages.push_back({1, 0, true, !is_sampled});
  return stages;
}

Json at_stage(const Json& scene, const SceneDescription& description, const Eigen::Vector2i& resolution,
              const Stage& stage) {
  Json result = scene;
  if (stage.coarseness > 1) {
    section(result, "receiver")["resolution"] = pixels(resolution, stage.coarseness);
    section(result, "camera")["resolution"] = pixels(description.camera.resolution, stage.coarseness);
    const auto fewer = static_cast<std::uint64_t>(stage.coarseness) * static_cast<std::uint64_t>(stage.coarseness);
    section(result, "light")["photons"] = std::max(description.light.photons / fewer, min_positions);
  }
  if (stage.samples > 0) {
    Json& integrator = section(result, "integrator");
    integrator["max_samples"] = std::min(integrator.value("max_samples", stage.samples), stage.samples);
    integrator["min_samples"] = 1;
  }
  return result;
}

std::vector<std::filesystem::path> outputs_of(const SceneDescription& description, const Stage& stage,
                                              const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files{folder / "picture.png"};
  if (!stage.all_outputs) return files;
  files.push_back(folder / "picture.exr");
  for (const Output& output : description.integrator.method().outputs())
    if (output.key == std::string("spectral") && !description.bending.rgb)
      files.push_back(folder / "picture.spectral.exr");
  return files;
}

}  // namespace tensorray
