#include "scenes/source/caption.h"

#include <algorithm>

#include <fmt/format.h>

namespace tensorray {
namespace {

/// The value of a key that is named as "light.direction" or "objects.0.plate"; null if the scene does not give it.
const Json* value_of(const Json& scene, const std::string& key) {
  const Json* value = &scene;
  for (std::size_t begin = 0; begin <= key.size();) {
    const std::size_t end = std::min(key.find('.', begin), key.size());
    const std::string name = key.substr(begin, end - begin);
    if (value->is_object() && value->contains(name)) {
      value = &(*value)[name];
    } else {
      const bool is_number =
          !name.empty() && name.size() < 7 && name.find_first_not_of("0123456789") == std::string::npos;
      if (!value->is_array() || !is_number || std::stoul(name) >= value->size()) return nullptr;
      value = &(*value)[std::stoul(name)];
    }
    begin = end + 1;
  }
  return value;
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
