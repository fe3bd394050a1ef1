#pragma once
/// @file scenes/keys/schema_writer.h
/// The visitor (see scene_keys.h) that writes the JSON Schema of one object.

#include <initializer_list>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "scenes/keys/generate_grid.h"
#include "scenes/keys/values.h"

namespace tensorray {

class SchemaWriter {
 public:
  template <class T>
  void operator()(const char* key, const T& member, const char* meaning, const Limits& limits = {}) {
    Json schema = {{"description", meaning}};
    const Json value = Value<T>::schema(member, limits);
    if (limits.word) {
      schema["anyOf"] = {value, {{"const", limits.word}}};
    } else {
      schema.update(value);
    }
    const Json standard = limits.word && is_word(member) ? Json(limits.word) : Value<T>::json(member);
    if (!standard.is_null() && !is_required(key)) schema["default"] = standard;
    if (!limits.examples.empty()) schema["examples"] = limits.examples;
    if (limits.is_knob) schema["knob"] = limits.from < limits.to ? Json{limits.from, limits.to} : Json(true);
    properties_[key] = schema;
  }

  template <class Keys>
  void section(const char* key, Keys&& keys, const char* meaning) {
    SchemaWriter inner;
    describe(keys, inner);
    properties_[key] = inner.finish(meaning);
  }

  template <class Keys>
  void section(const char* key, std::optional<Keys>&, const char* meaning) {
    section(key, Keys(), meaning);
  }

  template <class T, class KeysOf>
  void list(const char* key, std::vector<T>&, const char* meaning, KeysOf keys_of) {
    T item;
    auto&& keys = keys_of(item);
    SchemaWriter inner;
    describe(keys, inner);
    properties_[key] = {{"description", meaning}, {"type", "array"}, {"items", inner.finish("")}};
  }

  template <class Part>
  void part(Part& part) {
    part.visit(*this);
  }

  void generator(const char* key, const std::optional<GenerateDescription>&, const char* meaning);

  void require(std::initializer_list<const char*> keys);
  void exactly_one(std::initializer_list<const char*> keys);
  void exclude(const char* key, std::initializer_list<const char*> others);

  template <class Enum>
  void only_for(std::initializer_list<const char*> keys, const char* chooser, Enum standard,
                std::initializer_list<Enum> values) {
    Json words = Json::array();
    bool is_default = false;
    for (const Enum value : values) {
      words.push_back(choice_name(value));
      is_default = is_default || value == standard;
    }
    Json chosen = {{"properties", {{chooser, {{"enum", words}}}}}};
    if (!is_default) chosen["required"] = {chooser};
    for (const char* key : keys) rules_.push_back({{"anyOf", {chosen, {{"not", {{"required", {key}}}}}}}});
  }

  /// The schema of the object.
  Json finish(const std::string& meaning) const;

 private:
  bool is_required(const std::string& key) const;

  // Whether a member has the value that Limits::word means.
  template <class T>
  static bool is_word(const T& member) {
    if constexpr (std::is_arithmetic_v<T>) return member == T{};
    return false;
  }
  template <class T>
  static bool is_word(const std::optional<T>& member) {
    return !member;
  }

  Json properties_ = Json::object();
  std::vector<std::string> required_;
  Json alternatives_ = Json::array(), rules_ = Json::array();
};

}  // namespace tensorray
