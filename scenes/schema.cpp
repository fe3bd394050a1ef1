#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "scenes/json_reader.h"
#include "scenes/read_scene.h"
#include "scenes/scene_keys.h"

namespace tensorray {
namespace {

// schema_of(member, limits): what JSON is allowed for a type.

Json schema_of(const bool&, const Limits&) { return {{"type", "boolean"}}; }

Json schema_of(const std::string&, const Limits&) { return {{"type", "string"}}; }

Json schema_of(const std::filesystem::path&, const Limits& limits) {
  Json schema = {{"type", "string"}, {"minLength", 1}};
  std::string pattern;
  for (const std::string& ending : limits.endings) pattern += (pattern.empty() ? "." : "|.") + ending.substr(1);
  if (!pattern.empty()) {
    std::string escaped;
    for (const char c : pattern) escaped += c == '.' ? "\\." : std::string(1, c);
    schema["pattern"] = "[^/](" + escaped + ")$";
  }
  return schema;
}

Json number_schema(const char* type, const Limits& limits) {
  Json schema = {{"type", type}};
  const auto add = [&schema, type](const char* key, double limit) {
    if (std::string(type) == "integer") {
      schema[key] = static_cast<std::int64_t>(limit);
    } else {
      schema[key] = limit;
    }
  };
  const double infinity = std::numeric_limits<double>::infinity();
  if (limits.minimum > -infinity) add(limits.minimum_excluded ? "exclusiveMinimum" : "minimum", limits.minimum);
  if (limits.maximum < infinity) add("maximum", limits.maximum);
  if (limits.not_zero) schema["not"] = {{"const", 0}};
  return schema;
}

Json schema_of(const double&, const Limits& limits) { return number_schema("number", limits); }

template <class Integer>
std::enable_if_t<std::is_integral_v<Integer>, Json> schema_of(const Integer&, const Limits& limits) {
  return number_schema("integer", limits);
}

template <class Enum>
std::enable_if_t<std::is_enum_v<Enum>, Json> schema_of(const Enum& member, const Limits&) {
  Json names = Json::array();
  for (const auto& choice : choices(member)) names.push_back(choice.name);
  return {{"enum", names}};
}

Json list_schema(int size, const Json& item) {
  return {{"type", "array"}, {"items", item}, {"minItems", size}, {"maxItems", size}};
}

template <class Scalar, int size>
Json schema_of(const Eigen::Matrix<Scalar, size, 1>&, const Limits& limits) {
  Limits each = limits;
  each.not_zero = false;
  const Json item = schema_of(Scalar(), each);
  Json schema = list_schema(size, item);
  if (limits.not_zero) schema["not"] = {{"const", std::vector<int>(size, 0)}};
  if (!limits.one_for_all) return schema;
  return {{"anyOf", {item, schema}}};
}

Json schema_of(const Eigen::Matrix3d&, const Limits& limits) {
  return list_schema(3, schema_of(Eigen::Vector3d(), limits));
}

Json schema_of(const std::vector<double>&, const Limits& limits) {
  const Json item = schema_of(double(), limits);
  return {{"anyOf", {item, {{"type", "array"}, {"items", item}, {"minItems", 1}}}}};
}

Json schema_of(const std::variant<int, Eigen::Vector3i>&, const Limits& limits) {
  return {{"anyOf", {schema_of(int(), limits), schema_of(Eigen::Vector3i(), limits)}}};
}

template <class T>
Json schema_of(const std::optional<T>&, const Limits& limits) {
  return schema_of(T(), limits);
}

// default_of(member): the JSON of a default; null where there is none to be told.

template <class T>
std::enable_if_t<std::is_arithmetic_v<T>, Json> default_of(const T& member) {
  return member;
}

template <class Enum>
std::enable_if_t<std::is_enum_v<Enum>, Json> default_of(const Enum& member) {
  return choice_name(member);
}

Json default_of(const std::string& member) { return member.empty() ? Json() : Json(member); }

Json default_of(const std::filesystem::path& member) { return default_of(member.string()); }

template <class Scalar, int size>
Json default_of(const Eigen::Matrix<Scalar, size, 1>& member) {
  return std::vector<Scalar>(member.data(), member.data() + size);
}

Json default_of(const Eigen::Matrix3d& member) {
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back(default_of(Eigen::Vector3d(member.row(i))));
  return rows;
}

Json default_of(const std::vector<double>& member) { return member; }

Json default_of(const std::variant<int, Eigen::Vector3i>& member) {
  return std::visit([](const auto& value) { return default_of(value); }, member);
}

template <class T>
Json default_of(const std::optional<T>& member) {
  return member ? default_of(*member) : Json();
}

/// Whether a member holds what Limits::word stands for.
template <class T>
bool is_word(const T& member) {
  if constexpr (std::is_arithmetic_v<T>) return member == T{};
  return false;
}

template <class T>
bool is_word(const std::optional<T>& member) {
  return !member;
}

/// The visitor of scene_keys.h that writes the schema of one object.
class SchemaWriter {
 public:
  template <class T>
  void operator()(const char* key, const T& member, const char* meaning, const Limits& limits = {}) {
    Json schema = {{"description", meaning}};
    const Json value = schema_of(member, limits);
    if (limits.word) {
      schema["anyOf"] = {value, {{"const", limits.word}}};
    } else {
      schema.update(value);
    }
    const Json standard = limits.word && is_word(member) ? Json(limits.word) : default_of(member);
    if (!standard.is_null() && !is_required(key)) schema["default"] = standard;
    properties_[key] = schema;
  }

  template <class Keys>
  void section(const char* key, Keys&& keys, const char* meaning) {
    SchemaWriter inner;
    describe(keys, inner);
    properties_[key] = inner.finish(meaning);
  }

  template <class Keys>
  void section(const char* key, std::optional<Keys>&, const char* meaning) {
    section(key, Keys(), meaning);
  }

  template <class T, class KeysOf>
  void list(const char* key, std::vector<T>&, const char* meaning, KeysOf keys_of) {
    T item;
    auto&& keys = keys_of(item);
    SchemaWriter inner;
    describe(keys, inner);
    properties_[key] = {{"description", meaning}, {"type", "array"}, {"items", inner.finish("")}};
  }

  void generator(const char* key, const std::optional<GenerateDescription>&, const char* meaning);

  void require(std::initializer_list<const char*> keys) { required_.insert(required_.end(), keys.begin(), keys.end()); }

  void exactly_one(std::initializer_list<const char*> keys) {
    for (const char* key : keys) alternatives_.push_back({{"required", {key}}});
  }

  void exclude(const char* key, std::initializer_list<const char*> others) {
    for (const char* other : others) exclusions_.push_back({{"not", {{"required", {key, other}}}}});
  }

  Json finish(const std::string& meaning) const {
    Json schema;
    if (!meaning.empty()) schema["description"] = meaning;
    schema["type"] = "object";
    schema["properties"] = properties_;
    schema["additionalProperties"] = false;
    if (!required_.empty()) schema["required"] = required_;
    if (!alternatives_.empty()) schema["oneOf"] = alternatives_;
    if (!exclusions_.empty()) schema["allOf"] = exclusions_;
    return schema;
  }

 private:
  bool is_required(const std::string& key) const {
    for (const std::string& required : required_) {
      if (required == key) return true;
    }
    return false;
  }

  Json properties_ = Json::object();
  std::vector<std::string> required_;
  Json alternatives_ = Json::array(), exclusions_ = Json::array();
};

void SchemaWriter::generator(const char* key, const std::optional<GenerateDescription>&, const char* meaning) {
  Json kinds = Json::array();
  for (const std::string& kind : generator_kinds()) {
    SchemaWriter inner;
    inner.require({"kind"});
    inner.properties_["kind"] = {{"description", "what field"}, {"const", kind}};
    GridRequest grid;
    describe(grid, inner);
    Generator parameters = generator_of(kind);
    std::visit([&inner](auto& alternative) { describe(alternative, inner); }, parameters);
    kinds.push_back(inner.finish(""));
  }
  properties_[key] = {{"description", meaning}, {"oneOf", kinds}};
}

}  // namespace

std::string scene_schema() {
  SceneDescription scene;
  SchemaWriter writer;
  describe(scene, writer);
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", "tensorray scene"}};
  schema.update(writer.finish("What tensorray renders. Lengths are in the field's world units, wavelengths in nm."));
  return schema.dump(2);
}

}  // namespace tensorray
