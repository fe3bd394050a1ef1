#include "scenes/source/frames.h"

#include <algorithm>

namespace tensorray {
namespace {

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

void allow_keyframes(Json& schema) {
  allow_in(schema);
  schema["$defs"]["keyframes"] = keyframes_form();
}

}  // namespace tensorray
