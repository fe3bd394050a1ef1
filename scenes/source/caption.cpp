#include <algorithm>

#include <fmt/format.h>

#include "scenes/source/overrides.h"

namespace tensorray {
namespace {

/// The value of a key that is named as "light.direction" or "objects.0.plate"; null if the scene does not give it.
const Json* value_of(const Json& scene, std::string key) {
  std::replace(key.begin(), key.end(), '.', '/');
  try {
    return &scene.at(Json::json_pointer("/" + key));
  } catch (const Json::exception&) {
    return nullptr;
  }
}

std::string text_of(const Json& value) {
  if (value.is_number()) return fmt::format("{:.4g}", value.get<double>());
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_array()) return value.dump();
  std::string text;
  for (const Json& each : value) text += (text.empty() ? "" : ", ") + text_of(each);
  return text;
}

}  // namespace

std::string with_values(const std::string& caption, const Json& scene, const SceneSource& source) {
  std::string text;
  std::size_t at = 0;
  for (std::size_t open; (open = caption.find('{', at)) != std::string::npos;) {
    const std::size_t close = caption.find('}', open);
    if (close == std::string::npos) source.fail("`/output/caption` has a { without a }");
    const std::string key = caption.substr(open + 1, close - open - 1);
    const Json* const value = value_of(scene, key);
    if (!value)
      source.fail(
          fmt::format("`/output/caption` has {{{}}}, but the scene does not give this key; name one of its keys, "
                      "as {{field.scale}}",
                      key));
    text += caption.substr(at, open - at) + text_of(*value);
    at = close + 1;
  }
  return text + caption.substr(at);
}

}  // namespace tensorray
