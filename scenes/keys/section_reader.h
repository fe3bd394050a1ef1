#pragma once
/// The visitors of tables of keys: one reads an object of the scene file into a description, one writes its schema.

#include <initializer_list>
#include <set>
#include <string>
#include <vector>

#include "scenes/keys/key_visitor.h"

namespace tensorray {

/// Reads one object. Each value is read when it is visited. `finish` then checks the rules for several keys, and
/// refuses keys that were not visited. Every error is a SceneError with the JSON pointer of the wrong value.
class SectionReader final : public KeyVisitor {
 public:
  /// @param pointer  JSON pointer of `object`; empty for the whole scene.
  SectionReader(const Json& object, std::string pointer, const SceneSource& source);

  void generator(const char* key, std::optional<GenerateDescription>& member, const char* meaning) override;
  void require(std::initializer_list<const char*> keys) override;
  void exactly_one(std::initializer_list<const char*> keys) override;
  void exclude(const char* key, std::initializer_list<const char*> others) override;

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

  void value(const char* key, KeyMember& member, const char* meaning, const Limits& limits) override;
  void object(const char* key, const char* meaning, const Describe& describe_keys) override;
  void objects(const char* key, const char* meaning, const Describe& describe_next) override;
  void only_where(std::initializer_list<const char*> keys, const char* chooser, const std::string& word,
                  const std::vector<std::string>& words) override;

  const Json* find(const char* key);
  std::string pointer_to(const std::string& key) const;
  [[noreturn]] void refuse(const std::string& key, const std::string& expected, const char* word = nullptr) const;
  void refuse_unknown_keys() const;
  void read_object(const Json& value, const std::string& key, const Describe& describe_keys) const;

  const Json& object_;
  std::string pointer_;
  const SceneSource& source_;
  std::set<std::string> known_;
  std::vector<std::string> required_, alternatives_;
  std::vector<Exclusion> exclusions_;
  std::vector<Stray> strays_;
};

/// Writes the JSON Schema of one object.
class SchemaWriter final : public KeyVisitor {
 public:
  void generator(const char* key, std::optional<GenerateDescription>& member, const char* meaning) override;
  void require(std::initializer_list<const char*> keys) override;
  void exactly_one(std::initializer_list<const char*> keys) override;
  void exclude(const char* key, std::initializer_list<const char*> others) override;

  /// The schema of the object.
  Json finish(const std::string& meaning) const;

 private:
  void value(const char* key, KeyMember& member, const char* meaning, const Limits& limits) override;
  void object(const char* key, const char* meaning, const Describe& describe_keys) override;
  void objects(const char* key, const char* meaning, const Describe& describe_next) override;
  void only_where(std::initializer_list<const char*> keys, const char* chooser, const std::string& word,
                  const std::vector<std::string>& words) override;

  Json properties_ = Json::object();
  std::vector<std::string> required_;
  Json alternatives_ = Json::array(), rules_ = Json::array();
};

}  // namespace tensorray
