#include "scenes/source/frames.h"

#include <algorithm>
#include <stdexcept>
#include <unordered_set>

#include <fmt/core.h>

namespace tensorray {
namespace {

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
