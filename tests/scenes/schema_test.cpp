// The schema and the reader use one table of keys. These tests give the values that the schema names to the reader, and
// check that both accept and refuse the same.

#include <nlohmann/json.hpp>

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

std::vector<Leaf> leaves() {
  std::vector<Leaf> all;
  collect(Json::parse(scene_schema()), Pointer(), smallest_scene(), all);
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

/// Whether the reader refused the value of this key, and not something else.
bool refused_for_its_value(const Leaf& leaf, const Json& value) {
  return refusal(leaf, value).find("`" + leaf.pointer.to_string() + "` must be ") != std::string::npos;
}

/// Every default that the schema allows to have keyframes is accepted as such, and others are not allowed to.
TEST(Schema, KeyframesTakeThePlaceOfNumbersAndListsOfNumbers) {
  const Json schema = Json::parse(scene_schema(SchemaKind::with_keyframes));
  EXPECT_EQ(schema.at("/$defs/keyframes/required"_json_pointer), Json::array({"keys"}));
  std::vector<Leaf> all;
  collect(schema, Pointer(), smallest_scene(), all);
  const Json reference = {{"$ref", "#/$defs/keyframes"}};
  int allowed = 0, others = 0;
  for (const Leaf& leaf : all) {
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

TEST(Schema, EveryKeyHasAMeaning) {
  ASSERT_GT(leaves().size(), 60u);
  for (const Leaf& leaf : leaves()) EXPECT_FALSE(leaf.schema.at("description").get<std::string>().empty());
}

TEST(Schema, TheReaderAcceptsEveryDefault) {
  for (const Leaf& leaf : leaves()) {
    if (!leaf.schema.contains("default")) continue;
    EXPECT_EQ(refusal(leaf, leaf.schema.at("default")), "") << leaf.pointer.to_string();
  }
}

/// The ends of the sliders of the live view are values of their keys.
TEST(Schema, TheReaderAcceptsTheEndsOfEverySlider) {
  int checked = 0;
  for (const Leaf& leaf : leaves()) {
    if (!leaf.schema.contains("knob") || !leaf.schema.at("knob").is_array()) continue;
    for (const Json& end : leaf.schema.at("knob")) {
      const Json value = leaf.schema.value("type", "") == "integer" ? Json(end.get<std::int64_t>()) : end;
      EXPECT_EQ(refusal(leaf, value), "") << leaf.pointer.to_string();
    }
    ++checked;
  }
  EXPECT_GE(checked, 6);
}

TEST(Schema, TheReaderKnowsEveryWordAndNoOther) {
  int checked = 0;
  for (const Leaf& leaf : leaves()) {
    if (!leaf.schema.contains("enum")) continue;
    for (const Json& name : leaf.schema.at("enum")) EXPECT_EQ(refusal(leaf, name), "") << leaf.pointer.to_string();
    EXPECT_TRUE(refused_for_its_value(leaf, "nonsense")) << leaf.pointer.to_string();
    ++checked;
  }
  EXPECT_GE(checked, 6);
}

TEST(Schema, TheReaderRefusesWhatIsOutOfRange) {
  int checked = 0;
  for (const Leaf& leaf : leaves()) {
    const Json number = leaf.schema.contains("anyOf") ? leaf.schema.at("anyOf").at(0) : leaf.schema;
    const std::string type = number.value("type", "");
    if (type != "number" && type != "integer") continue;
    const std::string where = leaf.pointer.to_string();
    EXPECT_TRUE(refused_for_its_value(leaf, "nonsense")) << where;
    if (number.contains("minimum")) {
      EXPECT_TRUE(refused_for_its_value(leaf, number.at("minimum").get<double>() - 1)) << where;
    }
    if (number.contains("exclusiveMinimum")) {
      EXPECT_TRUE(refused_for_its_value(leaf, number.at("exclusiveMinimum"))) << where;
    }
    if (number.contains("maximum")) {
      EXPECT_TRUE(refused_for_its_value(leaf, 2 * number.at("maximum").get<double>())) << where;
    }
    if (number.contains("not")) {
      EXPECT_TRUE(refused_for_its_value(leaf, 0)) << where;
    }
    if (type == "integer") {
      EXPECT_TRUE(refused_for_its_value(leaf, 1.5)) << where;
    }
    ++checked;
  }
  EXPECT_GE(checked, 20);
}

TEST(Schema, TheReaderRefusesListsOfAnotherLength) {
  int checked = 0;
  for (const Leaf& leaf : leaves()) {
    if (!leaf.schema.contains("maxItems")) continue;
    const auto size = leaf.schema.at("maxItems").get<std::size_t>();
    EXPECT_TRUE(refused_for_its_value(leaf, std::vector<int>(size + 1, 1))) << leaf.pointer.to_string();
    EXPECT_TRUE(refused_for_its_value(leaf, Json::array())) << leaf.pointer.to_string();
    ++checked;
  }
  EXPECT_GE(checked, 8);
}

}  // namespace
}  // namespace tensorray
