#pragma once
/// @file scenes/keys/schema_writer.h
/// The visitor that writes the JSON Schema of one object.

#include <initializer_list>
#include <string>
#include <vector>

#include "scenes/keys/key_visitor.h"

namespace tensorray {

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
