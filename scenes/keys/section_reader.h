#pragma once
/// @file scenes/keys/section_reader.h
/// The visitor (see scene_keys.h) that reads an object of the scene file into a description.

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include <fmt/core.h>

#include "scenes/keys/generate_grid.h"
#include "scenes/keys/json_reader.h"
#include "scenes/keys/scene_source.h"
#include "scenes/keys/values.h"

namespace tensorray {

/// Reads one object. Each value is read when it is visited. `finish` then checks the rules for several keys, and
/// refuses keys that were not visited. Every error is a SceneError with the JSON pointer of the wrong value.
class SectionReader {
 public:
  /// @param pointer  JSON pointer of `object`; empty for the whole scene.
  SectionReader(const Json& object, std::string pointer, const SceneSource& source);

  template <class T>
  void operator()(const char* key, T& member, const char* /*meaning*/, const Limits& limits = {}) {
    const Json* value = find(key);
    if (!value) return;
    if (limits.word && *value == limits.word) {
      set_word(member);
    } else if (!Value<T>::read(*value, limits, member)) {
      refuse(key, Value<T>::expectation(member, limits), limits.word);
    }
    resolve(member);
  }

  template <class Keys>
  void section(const char* key, Keys&& keys, const char* /*meaning*/) {
    if (find(key)) read_object(key, keys);
  }

  template <class Keys>
  void section(const char* key, std::optional<Keys>& keys, const char* /*meaning*/) {
    if (find(key)) read_object(key, keys.emplace());
  }

  template <class T, class KeysOf>
  void list(const char* key, std::vector<T>& items, const char* /*meaning*/, KeysOf keys_of) {
    const Json* value = find(key);
    if (!value) return;
    if (!value->is_array()) refuse(key, "a list of objects");
    items.resize(value->size());
    SectionReader elements(*value, pointer_to(key), source_);
    for (std::size_t i = 0; i < items.size(); ++i) {
      auto&& keys = keys_of(items[i]);
      elements.read_item((*value)[i], std::to_string(i), keys);
    }
  }

  /// Keys of this object that another class describes. It calls this reader.
  template <class Part>
  void part(Part& part) {
    part.visit(*this);
  }

  void generator(const char* key, std::optional<GenerateDescription>& member, const char* meaning);

  void require(std::initializer_list<const char*> keys);
  void exactly_one(std::initializer_list<const char*> keys);
  void exclude(const char* key, std::initializer_list<const char*> others);

  /// Keys that are allowed only if `value`, the member of the key `chooser`, is one of `values`.
  template <class Enum>
  void only_for(std::initializer_list<const char*> keys, const char* chooser, Enum value,
                std::initializer_list<Enum> values) {
    if (std::find(values.begin(), values.end(), value) != values.end()) return;
    std::string allowed;
    for (const Enum each : values) allowed += fmt::format("{}\"{}\"", allowed.empty() ? "" : " or ", choice_name(each));
    for (const char* key : keys)
      if (object_.contains(key)) strays_.push_back({key, chooser, choice_name(value), allowed});
  }

  /// @throw SceneError: an unknown key (with the nearest known one), a missing key, keys that exclude each other.
  void finish() const;

 private:
  struct Exclusion {
    std::string key, other;
  };

  /// A key that belongs to another kind of object.
  struct Stray {
    std::string key, chooser, value, allowed;
  };

  const Json* find(const char* key);
  std::string pointer_to(const std::string& key) const;
  [[noreturn]] void refuse(const std::string& key, const std::string& expected, const char* word = nullptr) const;
  void refuse_unknown_keys() const;

  // Sets the value that Limits::word means: no value, or 0.
  template <class T>
  static void set_word(T& member) {
    if constexpr (std::is_arithmetic_v<T>) member = 0;
  }
  static void set_word(std::string& member) { member.clear(); }
  template <class T>
  static void set_word(std::optional<T>& member) {
    member.reset();
  }

  template <class T>
  void resolve(T&) const {}
  void resolve(std::filesystem::path& path) const { path = source_.resolve(path); }
  template <class... T>
  void resolve(std::variant<T...>& value) const {
    if constexpr ((std::is_same_v<T, std::filesystem::path> || ...))
      if (auto* path = std::get_if<std::filesystem::path>(&value)) resolve(*path);
  }

  template <class Keys>
  void read_object(const char* key, Keys& keys) {
    read_item(*find(key), key, keys);
  }

  template <class Keys>
  void read_item(const Json& value, const std::string& key, Keys& keys) {
    if (!value.is_object()) {
      source_.fail(fmt::format("`{}` must be an object, but is {}", pointer_to(key), excerpt(value)));
    }
    SectionReader inner(value, pointer_to(key), source_);
    describe(keys, inner);
    inner.finish();
  }

  const Json& object_;
  std::string pointer_;
  const SceneSource& source_;
  std::set<std::string> known_;
  std::vector<std::string> required_, alternatives_;
  std::vector<Exclusion> exclusions_;
  std::vector<Stray> strays_;
};

}  // namespace tensorray
