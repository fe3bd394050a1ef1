#include "tools/viewer/stages.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "integrators/methods/read_scene.h"
#include "scenes/description/check_scene.h"
#include "scenes/scene/kept_results.h"

namespace tensorray {
namespace {

constexpr double max_pixels = 2048.0 * 2048;
constexpr double max_positions = 1 << 22;
constexpr double max_generated_voxels = 256.0 * 256 * 256;
constexpr int max_bands = 512;
constexpr double max_ray_steps = 1 << 22;  // Of one ray, which cannot be interrupted.

std::filesystem::path resolved(const std::filesystem::path& file) {
  std::error_code none;
  const std::filesystem::path path = std::filesystem::weakly_canonical(std::filesystem::absolute(file), none);
  return none ? file : path;
}

void require_at_most(double limit, double value, const char* key, const SceneDescription& scene) {
  if (value > limit)
    throw SceneError(
        fmt::format("{}: `{}`: too large for a live view, which takes {:g} at most; use `tensorray render`",
                    printable(scene.path.string()), key, limit));
}

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

Json section(const Json& scene, const char* key) {
  const auto found = scene.find(key);
  return found == scene.end() || !found->is_object() ? Json::object() : *found;
}

Json without(Json section, const std::vector<const char*>& keys) {
  for (const char* key : keys) section.erase(key);
  return section;
}

/// What the automatic direction depends on.
Json direction_keys(const Json& scene) {
  return {without(section(scene, "field"), {"scale"}), section(scene, "light").value("up", Json()),
          section(scene, "world"), section(scene, "integrator").value("type", Json())};
}

/// What the automatic scale depends on.
Json scale_keys(const Json& scene) {
  return {direction_keys(scene), section(scene, "light").value("direction", Json()), section(scene, "camera")};
}

Json with_names(Json scene, const std::vector<std::filesystem::path>& outputs) {
  Json files = Json::array();
  for (const std::filesystem::path& output : outputs) files.push_back(output.string());
  return {std::move(scene), std::move(files)};
}

/// What the picture in linear light depends on.
Json picture_keys(Json scene, const std::vector<std::filesystem::path>& outputs) {
  scene["output"] = without(section(scene, "output"), {"exposure", "display", "view"});
  return with_names(std::move(scene), outputs);
}

}  // namespace

std::set<std::filesystem::path> resolved_files(const SceneDescription& scene) {
  std::set<std::filesystem::path> files;
  for (const NamedFile& file : input_files(scene))
    if (!file.path.empty()) files.insert(resolved(file.path));
  return files;
}

void require_files(const SceneDescription& scene, const std::set<std::filesystem::path>& allowed) {
  for (const NamedFile& file : input_files(scene))
    if (!file.path.empty() && allowed.count(resolved(file.path)) == 0)
      throw SceneError(printable(
          fmt::format("{}: {} is not a file of the scene that this view was started with; a page may use no other",
                      file.name, file.path.string())));
}

void require_moderate(const SceneDescription& scene) {
  if (scene.receiver.resolution)
    require_at_most(max_pixels, scene.receiver.resolution->cast<double>().prod(), "/receiver/resolution", scene);
  require_at_most(max_pixels, scene.camera.resolution.cast<double>().prod(), "/camera/resolution", scene);
  require_at_most(max_positions, static_cast<double>(scene.light.photons), "/light/photons", scene);
  require_at_most(max_bands, scene.light.wavelength_count, "/light/wavelengths/count", scene);
  require_at_most(max_ray_steps, scene.bending.settings.max_steps, "/bending/max_steps", scene);
  if (scene.field.generate)
    require_at_most(max_generated_voxels, scene.field.generate->grid.resolution.cast<double>().prod(),
                    "/field/generate/resolution", scene);
}

std::deque<Stage> stages_of(int coarseness, bool is_sampled) {
  std::deque<Stage> stages;
  if (coarseness > 1) stages.push_back({coarseness, 1});
  if (coarseness > 4) stages.push_back({4, few_samples});
  stages.push_back({1, is_sampled ? few_samples : 0});
  stages.push_back({1, 0, true, !is_sampled});
  return stages;
}

bool differ_in(const std::vector<const char*>& keys, const Json& scene, const Json& other) {
  const auto others = [&](Json json) {
    json["integrator"] = without(section(json, "integrator"), keys);
    return json;
  };
  return scene != other && others(scene) == others(other);
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

const Scene& LiveScene::load(const Json& json, const std::vector<std::filesystem::path>& outputs,
                             const Progress& progress) {
  const Json loaded = with_names(json, outputs);
  if (scene_ && loaded == loaded_) return *scene_;
  SceneDescription description = read_scene_json(json, file_, {{}, outputs, {}, imported_});
  const Json of_scale = scale_keys(json), of_direction = direction_keys(json);
  const bool chooses_scale = !description.field.scale, chooses_direction = !description.light.direction;
  if (chooses_scale && of_scale == of_scale_) description.field.scale = scale_;
  if (chooses_direction && of_direction == of_direction_) description.light.direction = direction_;

  Scene scene = load_scene(description, progress, field_of(scene_, description));
  if (!scene.kept) scene.kept = std::make_shared<KeptResults>();

  // From here on nothing fails: the scene before is replaced as a whole.
  if (!has_picture(json, outputs)) render_.reset();
  scale_ = chooses_scale ? std::optional(scene.scale.scale) : std::nullopt;
  direction_ = chooses_direction ? scene.description.light.direction : std::nullopt;
  scene_.emplace(std::move(scene));
  loaded_ = loaded;
  of_scale_ = of_scale;
  of_direction_ = of_direction;
  rendered_ = picture_keys(json, outputs);
  return *scene_;
}

std::shared_ptr<const Render> LiveScene::render(const Progress& progress) {
  if (!render_) render_ = std::make_shared<const Render>(tensorray::render(*scene_, progress));
  return render_;
}

bool LiveScene::has_picture(const Json& json, const std::vector<std::filesystem::path>& outputs) const {
  return render_ && picture_keys(json, outputs) == rendered_;
}

}  // namespace tensorray
