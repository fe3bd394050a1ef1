#include <algorithm>

#include "integrators/polariscope/polariscope_method.h"

namespace tensorray {
namespace {

const char* const element_forms =
    R"({"polarizer": DEGREES}, {"quarter_wave": DEGREES} or {"retarder": NM, "axis": DEGREES})";

const char* const element_names[] = {"polarizer", "quarter_wave", "retarder"};  // In the order of ElementKind.

/// Reads a list of {"NAME": DEGREES}, and {"retarder": NM, "axis": DEGREES}.
bool read_elements(const Json& json, std::vector<Element>& elements) {
  for (const Json& item : json) {
    const auto* const name = std::find_if(std::begin(element_names), std::end(element_names),
                                          [&](const char* each) { return item.is_object() && item.contains(each); });
    if (name == std::end(element_names)) return false;
    const auto kind = static_cast<ElementKind>(name - element_names);
    const bool has_axis = kind == ElementKind::retarder;
    const Json value = item[*name], angle = has_axis ? item.value("axis", Json()) : value;
    if (item.size() != (has_axis ? 2 : 1) || !value.is_number() || !angle.is_number()) return false;
    elements.push_back({kind, angle, has_axis ? value.get<double>() : 0});
  }
  return json.is_array();
}

Json element_schema() {
  Json element{{"type", "object"}, {"additionalProperties", false}};
  for (const char* key : {"polarizer", "quarter_wave", "retarder", "axis"})
    element["properties"][key] = {{"type", "number"}};
  return {{"type", "array"}, {"items", element}};
}

}  // namespace

using Arranged = Value<ArrangementDescription>;
using Optic = Value<StressOpticDescription>;

bool Arranged::read(const Json& json, const Limits& limits, ArrangementDescription& target) {
  ArrangementWord word{};
  if (json.is_string()) {
    const bool is_known = Value<ArrangementWord>::read(json, limits, word);
    target = word;
    return is_known;
  }
  Arrangement lists;
  if (!json.is_object() || json.empty()) return false;
  for (const auto& [key, value] : json.items()) {
    if (key != "before" && key != "after") return false;
    if (!read_elements(value, key == "before" ? lists.before : lists.after)) return false;
  }
  target = lists;
  return true;
}

std::string Arranged::expectation(const ArrangementDescription&, const Limits&) {
  return fmt::format("one of {}, or an object with the lists `before` and `after` of elements {}",
                     quoted_choices<ArrangementWord>(), element_forms);
}

Json Arranged::schema(const ArrangementDescription&, const Limits& limits) {
  const Json words = Value<ArrangementWord>::schema({}, limits);
  const Json lists{{"type", "object"},
                   {"properties", {{"before", element_schema()}, {"after", element_schema()}}},
                   {"minProperties", 1},
                   {"additionalProperties", false}};
  return {{"anyOf", {words, lists}}, {"examples", words.at("enum")}};
}

Json Arranged::json(const ArrangementDescription& value) {
  const auto* word = std::get_if<ArrangementWord>(&value);
  return word ? Json(choice_name(*word)) : Json();
}

bool Optic::read(const Json& json, const Limits& limits, StressOpticDescription& target) {
  if (json.is_number()) {
    target = json.get<double>();
    return std::get<double>(target) != 0;
  }
  if (json == "auto") {
    target = OpticChoice::automatic;
    return true;
  }
  return json.is_string() && names_file(json.get<std::string>()) &&
         Value<std::filesystem::path>::read(json, limits, target.emplace<std::filesystem::path>());
}

std::string Optic::expectation(const StressOpticDescription&, const Limits&) {
  return "a number other than 0, \"auto\", or a file (NAME.txt) of wavelengths (nm) and coefficients";
}

Json Optic::schema(const StressOpticDescription&, const Limits&) {
  return {{"anyOf", {{{"type", "number"}, {"not", {{"const", 0}}}}, {{"const", "auto"}}, {{"type", "string"}}}}};
}

Json Optic::json(const StressOpticDescription& value) {
  return std::holds_alternative<OpticChoice>(value) ? Json("auto") : Json();
}

Arrangement arrangement_of(const ArrangementDescription& description) {
  const auto* word = std::get_if<ArrangementWord>(&description);
  if (!word) return std::get<Arrangement>(description);
  const auto polarizer = [](double angle) { return Element{ElementKind::polarizer, angle}; };
  const auto quarter_wave = [](double angle) { return Element{ElementKind::quarter_wave, angle}; };
  const bool is_light = *word == ArrangementWord::circular_light || *word == ArrangementWord::plane_light;
  Arrangement result{{polarizer(0)}, {polarizer(is_light ? 0 : 90)}};
  if (*word == ArrangementWord::tint) result.before.push_back({ElementKind::retarder, 45, 550});
  if (*word == ArrangementWord::circular || *word == ArrangementWord::circular_light) {
    result.before.push_back(quarter_wave(45));
    result.after.insert(result.after.begin(), quarter_wave(-45));
  }
  return result;
}

}  // namespace tensorray
