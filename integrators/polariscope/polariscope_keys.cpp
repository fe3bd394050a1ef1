#include <algorithm>

#include "base/text/text.h"
#include "integrators/polariscope/polariscope_method.h"

namespace tensorray {
namespace {

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

std::vector<std::string> arrangement_names() {
  std::vector<std::string> names;
  for (const NamedArrangement& each : named_arrangements()) names.emplace_back(each.name);
  return names;
}

}  // namespace

bool Value<Arrangement>::read(const Json& json, const Limits&, Arrangement& target) {
  for (const auto& [name, elements] : named_arrangements()) {
    target = elements;
    if (json == name) return true;
  }
  target = {};
  if (!json.is_object() || json.empty()) return false;
  for (const auto& [key, value] : json.items()) {
    if (key != "before" && key != "after") return false;
    if (!read_elements(value, key == "before" ? target.before : target.after)) return false;
  }
  return true;
}

std::string Value<Arrangement>::expectation(const Arrangement&, const Limits&) {
  return fmt::format(R"(one of "{}", or an object with the lists `before` and `after` of elements )"
                     R"({{"polarizer": DEGREES}}, {{"quarter_wave": DEGREES}} or {{"retarder": NM, "axis": DEGREES}})",
                     joined(arrangement_names(), R"(", ")"));
}

Json Value<Arrangement>::schema(const Arrangement&, const Limits&) {
  Json element{{"type", "object"}, {"additionalProperties", false}};
  for (const char* key : {"polarizer", "quarter_wave", "retarder", "axis"})
    element["properties"][key] = {{"type", "number"}};
  const Json list{{"type", "array"}, {"items", element}}, names = arrangement_names();
  const Json lists{{"type", "object"},
                   {"properties", {{"before", list}, {"after", list}}},
                   {"minProperties", 1},
                   {"additionalProperties", false}};
  return {{"anyOf", {{{"enum", names}}, lists}}, {"examples", names}};
}

Json Value<Arrangement>::json(const Arrangement&) { return named_arrangements().front().name; }

bool Value<StressOptic>::read(const Json& json, const Limits& limits, StressOptic& target) {
  if (json.is_number()) return Value<double>::read(json, not_zero(), target.emplace<double>());
  target = OpticChoice::automatic;
  return json == "auto" || (json.is_string() && names_file(json.get<std::string>()) &&
                            Value<std::filesystem::path>::read(json, limits, target.emplace<std::filesystem::path>()));
}

std::string Value<StressOptic>::expectation(const StressOptic&, const Limits&) {
  return "a number other than 0, \"auto\", or a file (NAME.txt) of wavelengths (nm) and coefficients";
}

Json Value<StressOptic>::schema(const StressOptic&, const Limits&) {
  return {{"anyOf", {Value<double>::schema(0, not_zero()), {{"const", "auto"}}, {{"type", "string"}}}}};
}

Json Value<StressOptic>::json(const StressOptic&) { return "auto"; }

}  // namespace tensorray
