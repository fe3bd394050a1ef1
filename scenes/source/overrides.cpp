#include "scenes/source/overrides.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <fmt/format.h>

#include "base/text/path_text.h"
#include "scenes/keys/values.h"

namespace tensorray {
namespace {

/// An override, split into its parts.
struct Override {
  std::string key;  ///< The whole key as written.
  std::vector<std::string> segments;
  Json value;

  [[noreturn]] void fail(const std::string& what) const { throw SceneError(printable("--set " + key + ": " + what)); }
};

std::vector<std::string> split(const std::string& key) {
  std::vector<std::string> segments(1);
  for (const char c : key) {
    if (c == '.')
      segments.emplace_back();
    else
      segments.back() += c;
  }
  return segments;
}

/// The JSON value of `text`; if `text` is not JSON, `text` as a string.
Json value_of(const std::string& text) {
  try {
    return parse_value(text);
  } catch (const Json::exception&) {
    return text;
  }
}

Override take_apart(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw SceneError(printable(fmt::format("--set {}: must be KEY=VALUE, as in light.photons=1000", text)));
  Override change{text.substr(0, equals), {}, {}};
  change.segments = split(change.key);
  const auto is_empty = [](const std::string& segment) { return segment.empty(); };
  if (std::any_of(change.segments.begin(), change.segments.end(), is_empty))
    change.fail("must be keys with one dot between them, as in light.photons");
  if (change.segments.size() > nesting_limit) change.fail(fmt::format("is deeper than {} levels", nesting_limit));
  try {
    change.value = value_of(text.substr(equals + 1));
  } catch (const SceneError& error) {
    change.fail(error.what());
  }
  return change;
}

bool is_index(const std::string& segment) {
  return segment.size() <= 6 && segment.find_first_not_of("0123456789") == std::string::npos;
}

std::size_t index_in(const Json& list, const std::string& segment, const Override& change) {
  if (!is_index(segment)) change.fail(fmt::format("`{}` must be a number: it is an index into a list", segment));
  const std::size_t index = std::stoul(segment);
  if (index > list.size()) change.fail(fmt::format("there is no item {}: the list has {}", index, list.size()));
  return index;
}

/// The value of `segment` in `parent`. It is made if there is none.
Json& child(Json& parent, const std::string& segment, const Override& change) {
  if (parent.is_null()) parent = segment == "0" ? Json::array() : Json::object();
  if (parent.is_object()) return parent[segment];
  if (!parent.is_array())
    change.fail(fmt::format("`{}` has no place in {}, which is neither object nor list", segment, excerpt(parent)));
  const std::size_t index = index_in(parent, segment, change);
  if (index == parent.size()) parent.push_back(nullptr);
  return parent[index];
}

void remove(Json& scene, const Override& change) {
  Json* parent = &scene;
  for (std::size_t i = 0; i + 1 < change.segments.size(); ++i) {
    const std::string& segment = change.segments[i];
    if (parent->is_object() && parent->contains(segment)) {
      parent = &(*parent)[segment];
    } else if (parent->is_array() && index_in(*parent, segment, change) < parent->size()) {
      parent = &(*parent)[std::stoul(segment)];
    } else {
      return;  // There is nothing to remove.
    }
  }
  const std::string& last = change.segments.back();
  if (parent->is_object())
    parent->erase(last);
  else if (parent->is_array() && index_in(*parent, last, change) < parent->size())
    parent->erase(std::stoul(last));
}

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

void apply_override(Json& scene, const std::string& text) {
  const Override change = take_apart(utf8_of(text));  // It may have a path of any bytes.
  if (change.value.is_null()) {
    remove(scene, change);
    return;
  }
  Json* target = &scene;
  for (const std::string& segment : change.segments) target = &child(*target, segment, change);
  *target = change.value;
}

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
