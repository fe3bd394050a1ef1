#include <algorithm>
#include <variant>

#include "scenes/keys/key_visitor.h"
#include "scenes/keys/section_reader.h"

namespace tensorray {

void SchemaWriter::value(const char* key, KeyMember& member, const char* meaning, const Limits& limits) {
  Json schema = {{"description", meaning}};
  const Json value = member.schema(limits);
  if (limits.word)
    schema["anyOf"] = {value, {{"const", limits.word}}};
  else
    schema.update(value);
  const Json standard = limits.word && member.is_word() ? Json(limits.word) : member.json();
  const bool is_required = std::find(required_.begin(), required_.end(), key) != required_.end();
  if (!standard.is_null() && !is_required) schema["default"] = standard;
  if (!limits.examples.empty()) schema["examples"] = limits.examples;
  if (limits.is_knob) schema["knob"] = limits.from < limits.to ? Json{limits.from, limits.to} : Json(true);
  properties_[key] = schema;
}

void SchemaWriter::object(const char* key, const char* meaning, const Describe& describe_keys) {
  SchemaWriter inner;
  describe_keys(inner);
  properties_[key] = inner.finish(meaning);
}

void SchemaWriter::objects(const char* key, const char* meaning, const Describe& describe_next) {
  SchemaWriter inner;
  describe_next(inner);
  properties_[key] = {{"description", meaning}, {"type", "array"}, {"items", inner.finish("")}};
}

void SchemaWriter::only_where(std::initializer_list<const char*> keys, const char* chooser, const std::string& word,
                              const std::vector<std::string>& words) {
  Json chosen = {{"properties", {{chooser, {{"enum", words}}}}}};
  const bool is_default = std::find(words.begin(), words.end(), word) != words.end();
  if (!is_default) chosen["required"] = {chooser};
  for (const char* key : keys) rules_.push_back({{"anyOf", {chosen, {{"not", {{"required", {key}}}}}}}});
}

void SchemaWriter::generator(const char* key, std::optional<GenerateDescription>& /*member*/, const char* meaning) {
  Json kinds = Json::array();
  for (const std::string& kind : generator_kinds()) {
    SchemaWriter inner;
    inner.require({"kind"});
    inner.properties_["kind"] = {{"description", "kind of field"}, {"const", kind}};
    GridRequest grid;
    describe(grid, inner);
    Generator parameters = generator_of(kind);
    std::visit([&inner](auto& alternative) { describe(alternative, inner); }, parameters);
    kinds.push_back(inner.finish(""));
  }
  properties_[key] = {{"description", meaning}, {"oneOf", kinds}};
}

void SchemaWriter::require(std::initializer_list<const char*> keys) {
  required_.insert(required_.end(), keys.begin(), keys.end());
}

void SchemaWriter::exactly_one(std::initializer_list<const char*> keys) {
  for (const char* key : keys) alternatives_.push_back({{"required", {key}}});
}

void SchemaWriter::exclude(const char* key, std::initializer_list<const char*> others) {
  for (const char* other : others) rules_.push_back({{"not", {{"required", {key, other}}}}});
}

Json SchemaWriter::finish(const std::string& meaning) const {
  Json schema;
  if (!meaning.empty()) schema["description"] = meaning;
  schema["type"] = "object";
  schema["properties"] = properties_;
  schema["additionalProperties"] = false;
  if (!required_.empty()) schema["required"] = required_;
  if (!alternatives_.empty()) schema["oneOf"] = alternatives_;
  if (!rules_.empty()) schema["allOf"] = rules_;
  return schema;
}

}  // namespace tensorray
