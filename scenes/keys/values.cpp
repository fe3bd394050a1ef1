#include "scenes/keys/values.h"

#include <cmath>

#include "base/text/path_text.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

bool within(double number, const Limits& limits) {
  if (!std::isfinite(number) || (limits.not_zero && number == 0)) return false;
  const bool above = limits.minimum_excluded ? number > limits.minimum : number >= limits.minimum;
  return above && number <= limits.maximum;
}

std::string range(const Limits& limits) {
  if (limits.not_zero) return " other than 0";
  if (std::isfinite(limits.maximum)) return fmt::format(" from {} to {}", limits.minimum, limits.maximum);
  if (std::isfinite(limits.minimum)) return fmt::format(" {} {}", limits.minimum_excluded ? ">" : ">=", limits.minimum);
  return "";
}

template <class Number>
Json number_schema(const char* type, const Limits& limits) {
  Json schema = {{"type", type}};
  if (std::isfinite(limits.minimum))
    schema[limits.minimum_excluded ? "exclusiveMinimum" : "minimum"] = static_cast<Number>(limits.minimum);
  if (std::isfinite(limits.maximum)) schema["maximum"] = static_cast<Number>(limits.maximum);
  if (limits.not_zero) schema["not"] = {{"const", 0}};
  return schema;
}

}  // namespace

Limits limits_of_each(Limits limits) {
  limits.not_zero = false;
  return limits;
}

std::string list_expectation(int size, const char* things, const Limits& limits) {
  const std::string length = limits.not_zero ? ", not all 0" : "";
  const std::string one = limits.one_for_all ? ", or one for all" : "";
  return fmt::format("a list of {} {}{}{}{}", size, things, range(limits_of_each(limits)), length, one);
}

Json list_schema(int size, const Json& item) {
  return {{"type", "array"}, {"items", item}, {"minItems", size}, {"maxItems", size}};
}

bool names_file(const std::string& text) { return text.find_first_of("./") != std::string::npos; }

// true or false

bool Value<bool>::read(const Json& json, const Limits&, bool& target) {
  if (!json.is_boolean()) return false;
  target = json.get<bool>();
  return true;
}

std::string Value<bool>::expectation(const bool&, const Limits&) { return "true or false"; }
Json Value<bool>::schema(const bool&, const Limits&) { return {{"type", "boolean"}}; }
Json Value<bool>::json(const bool& value) { return value; }

// Integers

bool is_integer(const Json& json, const Limits& limits) {
  const double number = json.is_number() ? json.get<double>() : NAN;
  return number == std::floor(number) && within(number, limits);
}

std::string integer_expectation(const Limits& limits) { return "an integer" + range(limits); }
Json integer_schema(const Limits& limits) { return number_schema<std::int64_t>("integer", limits); }

// Numbers

bool Value<double>::read(const Json& json, const Limits& limits, double& target) {
  if (!json.is_number()) return false;
  target = json.get<double>();
  return within(target, limits);
}

std::string Value<double>::expectation(const double&, const Limits& limits) { return "a number" + range(limits); }
Json Value<double>::schema(const double&, const Limits& limits) { return number_schema<double>("number", limits); }
Json Value<double>::json(const double& value) { return value; }

// Texts

bool Value<std::string>::read(const Json& json, const Limits&, std::string& target) {
  if (!json.is_string()) return false;
  target = json.get<std::string>();
  return target.find('\0') == std::string::npos;
}

std::string Value<std::string>::expectation(const std::string&, const Limits&) { return "a string"; }
Json Value<std::string>::schema(const std::string&, const Limits&) { return {{"type", "string"}}; }
Json Value<std::string>::json(const std::string& value) { return value.empty() ? Json() : Json(value); }

// File names

bool Value<std::filesystem::path>::read(const Json& json, const Limits& limits, std::filesystem::path& target) {
  std::string text;
  if (!Value<std::string>::read(json, limits, text) || text.empty()) return false;
  target = path_of_text(text);
  const std::string name = target.filename().string();
  const auto ends = [&](const std::string& ending) { return name.size() > ending.size() && ends_with(name, ending); };
  return limits.endings.empty() || std::any_of(limits.endings.begin(), limits.endings.end(), ends);
}

std::string Value<std::filesystem::path>::expectation(const std::filesystem::path&, const Limits& limits) {
  std::string endings;
  for (const std::string& ending : limits.endings) endings += (endings.empty() ? " ending in " : " or ") + ending;
  return "a file name" + endings;
}

Json Value<std::filesystem::path>::schema(const std::filesystem::path&, const Limits& limits) {
  Json schema = {{"type", "string"}, {"minLength", 1}};
  std::string pattern;
  for (const std::string& ending : limits.endings) pattern += (pattern.empty() ? "\\." : "|\\.") + ending.substr(1);
  if (!pattern.empty()) schema["pattern"] = "[^/](" + pattern + ")$";
  return schema;
}

Json Value<std::filesystem::path>::json(const std::filesystem::path& value) {
  return Value<std::string>::json(text_of_path(value));
}

// Words known at run time

bool Value<Word>::read(const Json& json, const Limits&, Word& target) {
  if (!json.is_string()) return false;
  target.value = json.get<std::string>();
  return std::find(target.allowed.begin(), target.allowed.end(), target.value) != target.allowed.end();
}

std::string Value<Word>::expectation(const Word& target, const Limits&) {
  return "one of \"" + joined(target.allowed, "\", \"") + "\"";
}
Json Value<Word>::schema(const Word& target, const Limits&) { return {{"enum", target.allowed}}; }
Json Value<Word>::json(const Word& value) { return Value<std::string>::json(value.value); }

// Lists

bool Value<Eigen::Matrix3d>::read(const Json& json, const Limits& limits, Eigen::Matrix3d& target) {
  if (!json.is_array() || json.size() != 3) return false;
  for (int i = 0; i < 3; ++i) {
    Eigen::Vector3d row;
    if (!Value<Eigen::Vector3d>::read(json[static_cast<std::size_t>(i)], limits, row)) return false;
    target.row(i) = row;
  }
  return true;
}

std::string Value<Eigen::Matrix3d>::expectation(const Eigen::Matrix3d&, const Limits&) {
  return "a list of 3 rows of 3 numbers";
}

Json Value<Eigen::Matrix3d>::schema(const Eigen::Matrix3d&, const Limits& limits) {
  return list_schema(3, Value<Eigen::Vector3d>::schema({}, limits));
}

Json Value<Eigen::Matrix3d>::json(const Eigen::Matrix3d& value) {
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back(Value<Eigen::Vector3d>::json(value.row(i)));
  return rows;
}

bool Value<std::vector<double>>::read(const Json& json, const Limits& limits, std::vector<double>& target) {
  const Json list = json.is_array() ? json : Json::array({json});
  target.resize(list.size());
  for (std::size_t i = 0; i < target.size(); ++i)
    if (!Value<double>::read(list[i], limits, target[i])) return false;
  return !target.empty();
}

std::string Value<std::vector<double>>::expectation(const std::vector<double>&, const Limits& limits) {
  return Value<double>::expectation(0, limits) + ", or a list of them";
}

Json Value<std::vector<double>>::schema(const std::vector<double>&, const Limits& limits) {
  const Json item = Value<double>::schema(0, limits);
  return {{"anyOf", {item, {{"type", "array"}, {"items", item}, {"minItems", 1}}}}};
}

Json Value<std::vector<double>>::json(const std::vector<double>& value) { return value; }

bool Value<std::vector<std::string>>::read(const Json& json, const Limits&, std::vector<std::string>& target) {
  if (!json.is_array() || !std::all_of(json.begin(), json.end(), [](const Json& item) { return item.is_string(); }))
    return false;
  target = json.get<std::vector<std::string>>();
  return true;
}

std::string Value<std::vector<std::string>>::expectation(const std::vector<std::string>&, const Limits&) {
  return "a list of strings";
}

Json Value<std::vector<std::string>>::schema(const std::vector<std::string>&, const Limits&) {
  return {{"type", "array"}, {"items", {{"type", "string"}}}};
}

Json Value<std::vector<std::string>>::json(const std::vector<std::string>& value) { return value; }

bool Value<IntegerOrThree>::read(const Json& json, const Limits& limits, IntegerOrThree& target) {
  if (json.is_array()) return Value<Eigen::Vector3i>::read(json, limits, target.emplace<Eigen::Vector3i>());
  return Value<int>::read(json, limits, target.emplace<int>());
}

std::string Value<IntegerOrThree>::expectation(const IntegerOrThree&, const Limits& limits) {
  return Value<int>::expectation(0, limits) + ", or a list of 3 of them";
}

Json Value<IntegerOrThree>::schema(const IntegerOrThree&, const Limits& limits) {
  return {{"anyOf", {Value<int>::schema(0, limits), Value<Eigen::Vector3i>::schema({}, limits)}}};
}

Json Value<IntegerOrThree>::json(const IntegerOrThree& value) {
  return std::visit([](const auto& each) { return Value<std::decay_t<decltype(each)>>::json(each); }, value);
}

std::string excerpt(const Json& value) {
  constexpr std::size_t longest = 60;
  const std::string text = value.dump(-1, ' ', true);
  return text.size() <= longest ? text : text.substr(0, longest) + "...";
}

}  // namespace tensorray
