#include "scenes/source/overrides.h"

#include <algorithm>
#include <stdexcept>
#include <unordered_set>

#include <fmt/core.h>
#include <fmt/format.h>

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

constexpr long max_frame = 1000000000;
constexpr long max_frames = 1000000;

/// Reads a number from the front of `text` and removes it; -1 if there is none.
long take_number(std::string& text) {
  std::size_t digits = 0;
  while (digits < text.size() && text[digits] >= '0' && text[digits] <= '9') ++digits;
  if (digits == 0 || digits > 10) return -1;
  const long number = std::stol(text.substr(0, digits));
  text.erase(0, digits);
  return number <= max_frame ? number : -1;
}

bool take(std::string& text, char wanted) {
  if (text.empty() || text[0] != wanted) return false;
  text.erase(0, 1);
  return true;
}

bool is_keyframes(const Json& json) { return json.is_object() && json.contains("keys"); }

/// Reads keyframes and gives their value at a frame.
class Keyframes {
 public:
  Keyframes(const Json& json, const std::string& pointer, const SceneSource& source)
      : keys_(json["keys"]), pointer_(pointer), source_(source) {
    for (const auto& [key, value] : json.items())
      if (key != "keys" && key != "ease") fail("has the unknown key `" + printable(key) + "`; known are keys, ease");
    const Json ease = json.value("ease", Json("linear"));
    if (ease != "linear" && ease != "smooth") fail("`ease` must be linear or smooth");
    is_smooth_ = ease == "smooth";
    if (!keys_.is_array() || keys_.empty()) fail("`keys` must be a list of [frame, value]");
    for (std::size_t i = 0; i < keys_.size(); ++i) check_key(i);
  }

  Json at(double frame) const {
    std::size_t next = 0;
    while (next < keys_.size() && frame_of(next) <= frame) ++next;
    if (next == 0 || next == keys_.size()) return keys_[next == 0 ? 0 : next - 1][1];
    const double begin = frame_of(next - 1);
    const double t = (frame - begin) / (frame_of(next) - begin);
    return between(keys_[next - 1][1], keys_[next][1], is_smooth_ ? t * t * (3 - 2 * t) : t);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { source_.fail("`" + pointer_ + "`: " + what); }

  double frame_of(std::size_t i) const { return keys_[i][0].get<double>(); }

  static bool is_value(const Json& value) {
    if (!value.is_array()) return value.is_number();
    return !value.empty() && std::all_of(value.begin(), value.end(), [](const Json& each) { return each.is_number(); });
  }

  void check_key(std::size_t i) const {
    const Json& key = keys_[i];
    if (!key.is_array() || key.size() != 2 || !key[0].is_number() || !is_value(key[1]))
      fail(fmt::format("key {} must be [frame, value], whose value is a number or a list of numbers", i + 1));
    if (i > 0 && !(frame_of(i) > frame_of(i - 1))) fail("the frames of `keys` must increase");
    if (key[1].is_array() != keys_[0][1].is_array() || key[1].size() != keys_[0][1].size())
      fail("the values of `keys` must have the same number of numbers");
  }

  /// Values that are equal keep their type: an integer stays one.
  static Json between(const Json& a, const Json& b, double t) {
    if (a == b) return a;
    if (!a.is_array()) return (1 - t) * a.get<double>() + t * b.get<double>();
    Json list = Json::array();
    for (std::size_t i = 0; i < a.size(); ++i) list.push_back(between(a[i], b[i], t));
    return list;
  }

  const Json keys_;
  const std::string pointer_;
  const SceneSource& source_;
  bool is_smooth_ = false;
};

/// Calls `change(value, pointer)` for each text and for each object of keyframes.
template <typename Change>
void for_each_value(Json& json, const std::string& pointer, const Change& change) {
  if (json.is_string() || is_keyframes(json)) return change(json, pointer);
  if (json.is_object())
    for (auto& [key, value] : json.items()) for_each_value(value, pointer + "/" + printable(key), change);
  if (json.is_array())
    for (std::size_t i = 0; i < json.size(); ++i) for_each_value(json[i], fmt::format("{}/{}", pointer, i), change);
}

const Json keyframes_reference = {{"$ref", "#/$defs/keyframes"}};

Json keyframes_form() {
  const Json number = {{"type", "number"}};
  const Json value = {{"anyOf", {number, {{"type", "array"}, {"items", number}, {"minItems", 1}}}}};
  const Json key = {{"type", "array"}, {"prefixItems", {number, value}}, {"items", false}, {"minItems", 2}};
  return {{"description", "values at frames, for --frames: [frame, value], with increasing frames"},
          {"type", "object"},
          {"properties",
           {{"keys", {{"type", "array"}, {"items", key}, {"minItems", 1}}},
            {"ease",
             {{"description", "how a value goes from one frame to the next"},
              {"enum", {"linear", "smooth"}},
              {"default", "linear"}}}}},
          {"required", Json::array({"keys"})},
          {"additionalProperties", false}};
}

/// Whether the schema is that of a number or of a list of numbers.
bool is_of_numbers(const Json& schema) {
  const Json type = schema.value("type", Json());
  if (type == "array") return schema.contains("items") && is_of_numbers(schema.at("items"));
  return type == "number" || type == "integer";
}

void allow_in(Json& schema) {
  if (is_of_numbers(schema)) {
    Json with_keyframes = Json::object(), alone = Json::object();
    for (const auto& [key, value] : schema.items())
      (key == "description" || key == "default" ? with_keyframes : alone)[key] = value;
    with_keyframes["anyOf"] = {alone, keyframes_reference};
    schema = with_keyframes;
    return;
  }
  for (const char* key : {"properties", "oneOf"})
    if (schema.contains(key))
      for (Json& each : schema[key]) allow_in(each);
  if (schema.contains("items")) allow_in(schema["items"]);
  if (!schema.contains("anyOf")) return;
  Json& alternatives = schema["anyOf"];
  if (std::any_of(alternatives.begin(), alternatives.end(), is_of_numbers)) alternatives.push_back(keyframes_reference);
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

std::vector<int> parse_frames(const std::string& text) {
  std::string rest = text;
  std::vector<int> frames;
  std::unordered_set<int> seen;
  long named = 0;  // Also those that are named again, so that a short text does not take long.
  do {
    const long first = take_number(rest);
    const long last = take(rest, '-') ? take_number(rest) : first;
    const long step = take(rest, 'x') ? take_number(rest) : 1;
    const bool is_range = first >= 0 && last >= first && step >= 1 && (rest.empty() || rest[0] == ',');
    if (!is_range)
      throw std::invalid_argument("--frames " + printable(text) +
                                  ": give frames such as 7, 1-240, 1-240x2, or a list of these, 1,3,7-9");
    named += (last - first) / step + 1;
    if (named > max_frames) throw std::invalid_argument("--frames " + printable(text) + ": more than a million frames");
    for (long frame = first; frame <= last; frame += step)
      if (seen.insert(static_cast<int>(frame)).second) frames.push_back(static_cast<int>(frame));
  } while (take(rest, ','));
  return frames;
}

void set_frame(Json& scene, int frame, const SceneSource& source) {
  for_each_value(scene, "", [&](Json& value, const std::string& pointer) {
    value = value.is_string() ? Json(numbered(value.get<std::string>(), frame))
                              : Keyframes(value, pointer, source).at(frame);
  });
}

void refuse_keyframes(const Json& scene, const SceneSource& source) {
  Json copy = scene;
  for_each_value(copy, "", [&](const Json& value, const std::string& pointer) {
    if (!value.is_string())
      source.fail("`" + pointer + "` has keyframes: give --frames, as --frames 1-240 (frame=1 in Python)");
  });
}

void allow_keyframes(Json& schema) {
  allow_in(schema);
  schema["$defs"]["keyframes"] = keyframes_form();
}

}  // namespace tensorray
