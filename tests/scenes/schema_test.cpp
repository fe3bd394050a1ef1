// The schema and the reader use one table of keys. These tests give the values that the schema names to the reader, and
// check that both accept and refuse the same.

#include "integrators/methods/read_scene.h"
#include "tests/names.h"

namespace tensorray {
namespace {

using Json = nlohmann::json;
using Pointer = Json::json_pointer;

/// A key that holds a value (not an object) in the schema.
struct Leaf {
  Pointer pointer;
  Json schema;
  Json scene;  ///< A scene to which the key can be added.
};

Json smallest_scene() { return {{"field", {{"file", "a.vdb"}}}, {"integrator", {{"type", "photon_distribution"}}}}; }

/// `scene`, with the kind of object that allows the key, if not all kinds do.
Json with_chooser(const Json& schema, const Pointer& pointer, const std::string& key, Json scene) {
  for (const Json& rule : schema.value("allOf", Json::array())) {
    if (!rule.contains("anyOf") || rule.at("/anyOf/1/not/required/0"_json_pointer) != key) continue;
    for (const auto& [chooser, words] : rule.at("/anyOf/0/properties"_json_pointer).items())
      scene[pointer / chooser] = words.at("enum").at(0);
  }
  return scene;
}

void collect(const Json& schema, const Pointer& pointer, const Json& scene, std::vector<Leaf>& leaves) {
  for (const auto& [key, value] : schema.at("properties").items()) {
    const Pointer inner = pointer / key;
    if (value.contains("properties")) {
      collect(value, inner, scene, leaves);
    } else if (key == "generate") {
      for (const Json& kind : value.at("oneOf")) {
        Json generated = scene;
        generated["field"] = {{"generate", {{"kind", kind.at("properties").at("kind").at("const")}}}};
        collect(kind, inner, generated, leaves);
      }
    } else {
      leaves.push_back({inner, value, with_chooser(schema, pointer, key, scene)});
    }
  }
}

std::vector<Leaf> leaves(SchemaKind kind = SchemaKind::one_frame) {
  std::vector<Leaf> all;
  collect(Json::parse(scene_schema(kind)), Pointer(), smallest_scene(), all);
  return all;
}

/// The message of the reader; empty if it accepts the scene.
std::string refusal(const Json& scene) {
  try {
    read_scene_json(nlohmann::ordered_json::parse(scene.dump()), "scene.json");
  } catch (const SceneError& error) {
    return error.what();
  }
  return "";
}

std::string refusal(const Leaf& leaf, const Json& value) {
  Json scene = leaf.scene;
  scene[leaf.pointer] = value;
  return refusal(scene);
}

/// Every default that the schema allows to have keyframes is accepted as such, and others are not allowed to.
TEST(Schema, KeyframesTakeThePlaceOfNumbersAndListsOfNumbers) {
  const Json schema = Json::parse(scene_schema(SchemaKind::with_keyframes));
  EXPECT_EQ(schema.at("/$defs/keyframes/required"_json_pointer), Json::array({"keys"}));
  const Json reference = {{"$ref", "#/$defs/keyframes"}};
  int allowed = 0, others = 0;
  for (const Leaf& leaf : leaves(SchemaKind::with_keyframes)) {
    const Json standard = leaf.schema.value("default", Json());
    const bool is_of_numbers =
        standard.is_number() || (standard.is_array() && !standard.empty() && standard[0].is_number());
    const Json alternatives = leaf.schema.value("anyOf", Json::array());
    const bool is_allowed = std::count(alternatives.begin(), alternatives.end(), reference) == 1;
    const std::string where = leaf.pointer.to_string();
    if (standard.is_boolean() || leaf.schema.contains("enum")) {
      EXPECT_FALSE(is_allowed) << where;
      ++others;
    }
    if (!is_of_numbers) continue;
    EXPECT_TRUE(is_allowed) << where;
    Json scene = leaf.scene;
    scene[leaf.pointer] = {{"keys", {{1, standard}, {5, standard}}}};
    EXPECT_NO_THROW(read_scene_json(nlohmann::ordered_json::parse(scene.dump()), "a.json", {{}, {}, 3})) << where;
    ++allowed;
  }
  EXPECT_GE(allowed, 40);
  EXPECT_GE(others, 6);
}

TEST(Schema, IsOfTheDraftAndClosed) {
  const Json schema = Json::parse(scene_schema());
  EXPECT_EQ(schema.at("$schema"), "https://json-schema.org/draft/2020-12/schema");
  EXPECT_EQ(schema.at("required"), Json({"field", "integrator"}));
  EXPECT_EQ(schema.at("additionalProperties"), false);
  EXPECT_EQ(schema.at("/properties/integrator/required"_json_pointer), Json::array({"type"}));
  EXPECT_EQ(schema.at("/properties/light/additionalProperties"_json_pointer), false);
  EXPECT_EQ(schema.at("/properties/light/properties/photons/default"_json_pointer), 1 << 20);
  EXPECT_EQ(schema.at("/properties/field/properties/scale/default"_json_pointer), "auto");
  EXPECT_EQ(schema.at("/properties/field/oneOf"_json_pointer).size(), 2u);
  EXPECT_EQ(schema.at("/properties/field/properties/generate/oneOf"_json_pointer).size(), generator_kinds().size());
}

/// Defaults, words, and the ends of the sliders of the live view.
TEST(Schema, TheReaderAcceptsWhatItNames) {
  int defaults = 0, sliders = 0, words = 0;
  for (const Leaf& leaf : leaves()) {
    const std::string where = leaf.pointer.to_string();
    EXPECT_FALSE(leaf.schema.at("description").get<std::string>().empty()) << where;
    if (leaf.schema.contains("default")) {
      EXPECT_EQ(refusal(leaf, leaf.schema.at("default")), "") << where;
      ++defaults;
    }
    for (const Json& name : leaf.schema.value("enum", Json::array())) {
      EXPECT_EQ(refusal(leaf, name), "") << where;
      ++words;
    }
    const Json knob = leaf.schema.value("knob", Json());
    if (!knob.is_array()) continue;
    for (const Json& end : knob) {
      const Json value = leaf.schema.value("type", "") == "integer" ? Json(end.get<std::int64_t>()) : end;
      EXPECT_EQ(refusal(leaf, value), "") << where;
    }
    ++sliders;
  }
  EXPECT_GT(defaults, 60);
  EXPECT_GE(sliders, 6);
  EXPECT_GE(words, 20);
}

/// Values that the schema of a key excludes.
std::vector<Json> excluded(const Json& schema) {
  std::vector<Json> values;
  if (schema.contains("enum")) values = {"nonsense"};
  if (schema.contains("maxItems")) {
    const auto size = schema.at("maxItems").get<std::size_t>();
    values = {Json(std::vector<int>(size + 1, 1)), Json::array()};
  }
  const Json number = schema.contains("anyOf") ? schema.at("anyOf").at(0) : schema;
  const std::string type = number.value("type", "");
  if (type != "number" && type != "integer") return values;
  values.emplace_back("nonsense");
  if (number.contains("minimum")) values.emplace_back(number.at("minimum").get<double>() - 1);
  if (number.contains("exclusiveMinimum")) values.push_back(number.at("exclusiveMinimum"));
  if (number.contains("maximum")) values.emplace_back(2 * number.at("maximum").get<double>());
  if (number.contains("not")) values.emplace_back(0);
  if (type == "integer") values.emplace_back(1.5);
  return values;
}

TEST(Schema, TheReaderRefusesWhatItExcludes) {
  int keys = 0, values = 0;
  for (const Leaf& leaf : leaves()) {
    const std::vector<Json> wrong = excluded(leaf.schema);
    for (const Json& value : wrong) {
      const std::string expected = "`" + leaf.pointer.to_string() + "` must be ";
      EXPECT_THAT(refusal(leaf, value), HasSubstr(expected)) << value;
    }
    keys += wrong.empty() ? 0 : 1;
    values += static_cast<int>(wrong.size());
  }
  EXPECT_GE(keys, 34);
  EXPECT_GE(values, 80);
}

}  // namespace
}  // namespace tensorray
