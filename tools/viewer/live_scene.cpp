#include "tools/viewer/live_scene.h"

#include <utility>

#include "integrators/methods/read_scene.h"
#include "scenes/scene/kept_results.h"
#include "tracing/flow/ray_memory.h"

namespace tensorray {
namespace {

Json section(const Json& scene, const char* key) {
  const auto found = scene.find(key);
  return found == scene.end() || !found->is_object() ? Json::object() : *found;
}

Json without(Json section, const std::vector<const char*>& keys) {
  for (const char* key : keys) section.erase(key);
  return section;
}

/// What automatic scale and direction depend on.
Json choice_keys(const Json& scene) {
  const Json light = section(scene, "light");
  return {without(section(scene, "field"), {"scale"}), light.value("direction", Json()), light.value("up", Json())};
}

Json with_names(Json scene, const std::vector<std::filesystem::path>& outputs) {
  Json files = Json::array();
  for (const std::filesystem::path& output : outputs) files.push_back(output.string());
  return {std::move(scene), std::move(files)};
}

/// What the way of a ray through the volume depends on.
Json ray_keys(const Json& json, const Scene& scene) {
  const Eigen::Vector3d& V = scene.beam.direction;
  return {section(json, "field"), section(json, "bending"), scene.scale.scale, V.x(), V.y(), V.z()};
}

/// What the picture in linear light depends on.
Json picture_keys(Json scene, const std::vector<std::filesystem::path>& outputs) {
  scene["output"] = without(section(scene, "output"), {"exposure", "display", "view"});
  return with_names(std::move(scene), outputs);
}

}  // namespace

const Scene& LiveScene::load(const Json& json, const std::vector<std::filesystem::path>& outputs,
                             const Progress& progress) {
  const Json loaded = with_names(json, outputs);
  if (scene_ && loaded == loaded_) return *scene_;
  SceneDescription description = read_scene_json(json, file_, {{}, outputs});
  const bool chooses_anew = choice_keys(json) != chosen_for_;
  const bool chooses_scale = !description.field.scale, chooses_direction = !description.light.direction;
  if (chooses_scale && !chooses_anew) description.field.scale = scale_;
  if (chooses_direction && !chooses_anew) description.light.direction = direction_;

  Scene scene = load_scene(description, progress, field_of(scene_, description));
  // A change that moves all rays begins without a memory: it would cost time and give nothing.
  const Json rays = ray_keys(json, scene);
  if (rays == rays_of_) scene.rays = scene_ && scene_->rays ? scene_->rays : std::make_shared<RayMemory>();

  if (!scene.kept) scene.kept = std::make_shared<KeptResults>();

  // From here on nothing fails: the scene before is replaced as a whole.
  if (!has_picture(json, outputs)) render_.reset();
  if (chooses_anew) {
    scale_.reset();
    direction_.reset();
  }
  if (chooses_scale) scale_ = scene.scale.scale;
  if (chooses_direction) direction_ = scene.description.light.direction;
  scene_.emplace(std::move(scene));
  loaded_ = loaded;
  chosen_for_ = choice_keys(json);
  rays_of_ = rays;
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
