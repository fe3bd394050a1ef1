#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "base/text/content_hash.h"
#include "scenes/description/check_scene.h"
#include "scenes/jobs/work_file.h"
#include "scenes/keys/values.h"

namespace tensorray {
namespace {

Json files_of(const SceneDescription& description) {
  Json files = Json::object();
  for (const NamedFile& file : input_files(description))
    if (!file.path.empty() && file.path != description.path)
      files[file.name] = fmt::format("{:016x}", file_hash(file.path));
  return files;
}

std::string shown(const Json& value) { return value.is_null() ? "not given" : excerpt(value); }

/// The pointer of the first value that differs, and both values; values of the same place are alike whatever the order
/// of their keys.
std::string scene_difference(const Json& there, const Json& here, const std::string& pointer) {
  if (there.is_object() && here.is_object()) {
    std::set<std::string> keys;
    for (const Json* each : {&there, &here})
      for (const auto& item : each->items()) keys.insert(item.key());
    for (const std::string& key : keys) {
      const std::string found =
          scene_difference(there.value(key, Json()), here.value(key, Json()), pointer + "/" + key);
      if (!found.empty()) return found;
    }
    return "";
  }
  return there == here ? "" : fmt::format("`{}` is {} there, {} here", pointer, shown(there), shown(here));
}

}  // namespace

Json origin_of(const Scene& scene) {
  const SceneDescription& description = scene.description;
  Json json = parse_value(description.text);
  json.erase("output");
  if (description.output.fluence_bands) json["output"]["fluence_bands"] = true;  // It is no file, but a setting.
  const Eigen::Vector3d direction = *description.light.direction;
  return {{"version", TENSORRAY_VERSION},
          {"method", description.integrator.method().name()},
          {"scene", json},
          {"scale", scene.scale.scale},
          {"direction", {direction.x(), direction.y(), direction.z()}},
          {"files", files_of(description)}};
}

bool is_origin(const Json& json) {
  const auto has = [&](const char* key, bool (Json::*is_right)() const) {
    return json.is_object() && json.contains(key) && (json.at(key).*is_right)();
  };
  const auto is_number = [](const Json& each) { return each.is_number(); };
  return has("version", &Json::is_string) && has("method", &Json::is_string) && has("scene", &Json::is_object) &&
         has("scale", &Json::is_number) && has("files", &Json::is_object) && has("direction", &Json::is_array) &&
         json.at("direction").size() == 3 &&
         std::all_of(json.at("direction").begin(), json.at("direction").end(), is_number);
}

std::string difference(const Json& there, const Json& here) {
  for (const char* key : {"version", "method"})
    if (there.value(key, Json()) != here.at(key))
      return fmt::format("its {} is {}, not {}", key, shown(there.value(key, Json())), shown(here.at(key)));
  const std::string scene = scene_difference(there.value("scene", Json()), here.at("scene"), "");
  if (!scene.empty()) return scene;
  const Json files = there.value("files", Json::object());
  for (const auto& [name, hash] : here.at("files").items())
    if (files.value(name, Json()) != hash) return fmt::format("the file {} has other contents", name);
  for (const char* key : {"scale", "direction"})
    if (there.value(key, Json()) != here.at(key))
      return fmt::format("its {} is {}, not {}", key, shown(there.value(key, Json())), shown(here.at(key)));
  return "";
}

void set_chosen(const Json& origin, SceneDescription& description) {
  if (!description.field.scale) description.field.scale = origin.at("scale").get<double>();
  if (description.light.direction) return;
  const Json& direction = origin.at("direction");
  description.light.direction =
      Eigen::Vector3d(direction.at(0).get<double>(), direction.at(1).get<double>(), direction.at(2).get<double>());
}

}  // namespace tensorray
