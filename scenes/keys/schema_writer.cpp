#include "scenes/keys/schema_writer.h"

#include <algorithm>
#include <variant>

namespace tensorray {

void SchemaWriter::generator(const char* key, const std::optional<GenerateDescription>&, const char* meaning) {
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

bool SchemaWriter::is_required(const std::string& key) const {
  return std::find(required_.begin(), required_.end(), key) != required_.end();
}

}  // namespace tensorray
