#pragma once
/// How values of each type are written in a scene file: one trait for each type.

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <fmt/core.h>

#include "scenes/keys/json_reader.h"

namespace tensorray {

/// Limits of one key, and how a form shows it. Limits that do not apply to the type of the key are ignored.
struct Limits {
  double minimum = -std::numeric_limits<double>::infinity();  ///< Least value of a number, or of each number of a list.
  double maximum = std::numeric_limits<double>::infinity();
  bool minimum_excluded = false;
  bool not_zero = false;       ///< A number must not be 0; the length of a vector must not be 0.
  bool one_for_all = false;    ///< One number may be given instead of a list of equal numbers.
  const char* word = nullptr;  ///< A string that is also allowed, for example "auto"; it is read as 0 or no value.
  std::vector<std::string> endings{};  ///< Allowed endings of a file name; empty: any.

  /// Whether the live view shows the key among its knobs, with a slider for a number. Its ends: `from` and `to`; those
  /// of the limits, if the two are equal; about the value that the render has chosen, if there are no such limits.
  bool is_knob = false;
  double from = 0, to = 0;
  std::vector<std::string> examples{};  ///< Of a text that may be any.

  Limits or_word(const char* allowed) && {
    word = allowed;
    return std::move(*this);
  }
  Limits or_one_for_all() && {
    one_for_all = true;
    return std::move(*this);
  }
  Limits as_knob(double slider_from = 0, double slider_to = 0) && {
    is_knob = true;
    from = slider_from;
    to = slider_to;
    return std::move(*this);
  }
  Limits with_examples(std::vector<std::string> texts) && {
    examples = std::move(texts);
    return std::move(*this);
  }
};

inline Limits knob(double from = 0, double to = 0) { return Limits().as_knob(from, to); }

inline Limits at_least(double minimum) {
  Limits limits;
  limits.minimum = minimum;
  return limits;
}

inline Limits above(double minimum) {
  Limits limits = at_least(minimum);
  limits.minimum_excluded = true;
  return limits;
}

inline Limits between(double minimum, double maximum) {
  Limits limits = at_least(minimum);
  limits.maximum = maximum;
  return limits;
}

inline Limits not_zero() {
  Limits limits;
  limits.not_zero = true;
  return limits;
}

inline Limits endings(std::vector<std::string> allowed) {
  Limits limits;
  limits.endings = std::move(allowed);
  return limits;
}

/// Names in scene files for the values of an enumeration, in its order. `words(Enum{})` returns them.
using Words = std::vector<const char*>;

/// The same as pairs. An enumeration whose names are listed in another order has `choices(Enum{})` instead of `words`.
template <class Enum>
struct Choice {
  const char* name;
  Enum value;
};
template <class Enum>
using Choices = std::vector<Choice<Enum>>;
template <class Enum>
Choices<Enum> choices(Enum) {
  Choices<Enum> all;
  for (const char* word : words(Enum{})) all.push_back({word, static_cast<Enum>(all.size())});
  return all;
}

/// The name of a value.
template <class Enum>
const char* choice_name(Enum value) {
  for (const auto& choice : choices(value))
    if (choice.value == value) return choice.name;
  return "";
}

/// A type that may be the value of a key has a specialisation `Value<T>` with four static functions:
///   bool read(json, limits, target)       sets `target`; returns false if the JSON value has another type or breaks a
///                                         limit (`target` may then have changed);
///   std::string expectation(target, limits)    describes the allowed values: "an integer >= 1";
///   Json schema(target, limits)           the JSON Schema of allowed values;
///   Json json(value)                      the JSON of a default; null if the schema shall show no default.
/// `expectation` and `schema` also need `target`, because the allowed words of a `Word` are known only at run time.
template <class T, class = void>
struct Value;

/// A word, and the list of allowed words, which is known only at run time.
struct Word {
  std::string value;
  std::vector<std::string> allowed;
};

/// Declares the trait of a type. A .cpp file defines its functions.
#define TENSORRAY_VALUE(T)                                                 \
  template <>                                                              \
  struct Value<T> {                                                        \
    static bool read(const Json& json, const Limits& limits, T& target);   \
    static std::string expectation(const T& target, const Limits& limits); \
    static Json schema(const T& target, const Limits& limits);             \
    static Json json(const T& value);                                      \
  }

TENSORRAY_VALUE(bool);
TENSORRAY_VALUE(double);
TENSORRAY_VALUE(std::string);
TENSORRAY_VALUE(std::filesystem::path);
TENSORRAY_VALUE(Word);
TENSORRAY_VALUE(Eigen::Matrix3d);      ///< A list of rows.
TENSORRAY_VALUE(std::vector<double>);  ///< A list, or one number.
TENSORRAY_VALUE(std::vector<std::string>);
using IntegerOrThree = std::variant<int, Eigen::Vector3i>;
TENSORRAY_VALUE(IntegerOrThree);

/// Of integers. They may be written as 1e6 or 4.0, as JSON Schema allows; their limits are exact in a double.
bool is_integer(const Json& json, const Limits& limits);
std::string integer_expectation(const Limits& limits);
Json integer_schema(const Limits& limits);

template <class Integer>
struct Value<Integer, std::enable_if_t<std::is_integral_v<Integer> && !std::is_same_v<Integer, bool>>> {
  static bool read(const Json& json, const Limits& limits, Integer& target) {
    if (!is_integer(json, limits)) return false;
    target = json.is_number_float() ? static_cast<Integer>(json.get<double>()) : json.get<Integer>();
    return true;
  }
  static std::string expectation(const Integer&, const Limits& limits) { return integer_expectation(limits); }
  static Json schema(const Integer&, const Limits& limits) { return integer_schema(limits); }
  static Json json(const Integer& value) { return value; }
};

/// Value::expectation of a list: "a list of 3 numbers >= 0".
std::string list_expectation(int size, const char* things, const Limits& limits);
Json list_schema(int size, const Json& item);

/// The limits of each number of a vector. They lack `not_zero`, which limits the length of the vector.
Limits limits_of_each(Limits limits);

template <class Scalar, int size>
struct Value<Eigen::Matrix<Scalar, size, 1>> {
  using Vector = Eigen::Matrix<Scalar, size, 1>;

  static bool read(const Json& json, const Limits& limits, Vector& target) {
    const Limits each = limits_of_each(limits);
    if (limits.one_for_all && json.is_number()) {
      if (!Value<Scalar>::read(json, each, target[0])) return false;
      target.setConstant(target[0]);
      return true;
    }
    if (!json.is_array() || json.size() != size) return false;
    for (int i = 0; i < size; ++i)
      if (!Value<Scalar>::read(json[static_cast<std::size_t>(i)], each, target[i])) return false;
    // The square must neither vanish nor overflow, because the vector will be normalised.
    const double square = target.template cast<double>().squaredNorm();
    return !limits.not_zero || (std::isnormal(square) && square > 0);
  }

  static std::string expectation(const Vector&, const Limits& limits) {
    return list_expectation(size, std::is_integral_v<Scalar> ? "integers" : "numbers", limits);
  }

  static Json schema(const Vector&, const Limits& limits) {
    const Json item = Value<Scalar>::schema(Scalar(), limits_of_each(limits));
    Json schema = list_schema(size, item);
    if (limits.not_zero) schema["not"] = {{"const", std::vector<int>(size, 0)}};
    if (!limits.one_for_all) return schema;
    return {{"anyOf", {item, schema}}};
  }

  static Json json(const Vector& value) { return std::vector<Scalar>(value.data(), value.data() + size); }
};

/// The names of an enumeration: `"a", "b", "c"`.
template <class Enum>
std::string quoted_choices() {
  std::string names;
  for (const auto& choice : choices(Enum{})) names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", choice.name);
  return names;
}

template <class Enum>
struct Value<Enum, std::enable_if_t<std::is_enum_v<Enum>>> {
  static bool read(const Json& json, const Limits&, Enum& target) {
    for (const auto& choice : choices(target)) {
      if (json != choice.name) continue;
      target = choice.value;
      return true;
    }
    return false;
  }

  static std::string expectation(const Enum& target, const Limits&) {
    return (choices(target).size() == 1 ? "" : "one of ") + quoted_choices<Enum>();
  }

  static Json schema(const Enum& target, const Limits&) {
    Json names = Json::array();
    for (const auto& choice : choices(target)) names.push_back(choice.name);
    return {{"enum", names}};
  }

  static Json json(const Enum& value) { return choice_name(value); }
};

/// A list of different values of an enumeration, or one of them.
template <class Enum>
struct Value<std::vector<Enum>, std::enable_if_t<std::is_enum_v<Enum>>> {
  static bool read(const Json& json, const Limits& limits, std::vector<Enum>& target) {
    const Json list = json.is_array() ? json : Json::array({json});
    target.clear();
    for (const Json& item : list) {
      Enum value{};
      if (!Value<Enum>::read(item, limits, value)) return false;
      if (std::find(target.begin(), target.end(), value) != target.end()) return false;
      target.push_back(value);
    }
    return true;
  }

  static std::string expectation(const std::vector<Enum>&, const Limits&) {
    return fmt::format("a list of {}, each at most once", quoted_choices<Enum>());
  }

  static Json schema(const std::vector<Enum>&, const Limits& limits) {
    const Json item = Value<Enum>::schema(Enum{}, limits);
    return {{"anyOf", {{{"type", "array"}, {"items", item}, {"uniqueItems", true}}, item}}};
  }

  static Json json(const std::vector<Enum>& value) {
    Json names = Json::array();
    for (const Enum each : value) names.push_back(choice_name(each));
    return names;
  }
};

/// Whether a text names a file and not a word: it has an ending or a folder.
bool names_file(const std::string& text);

/// The name of a value of an enumeration, or a file.
template <class Enum>
struct Value<std::variant<Enum, std::filesystem::path>, std::enable_if_t<std::is_enum_v<Enum>>> {
  using Variant = std::variant<Enum, std::filesystem::path>;

  static bool read(const Json& json, const Limits& limits, Variant& target) {
    Enum word{};
    if (Value<Enum>::read(json, limits, word)) {
      target = word;
      return true;
    }
    return json.is_string() && names_file(json.get<std::string>()) &&
           Value<std::filesystem::path>::read(json, limits, target.template emplace<std::filesystem::path>());
  }

  static std::string expectation(const Variant&, const Limits&) {
    return fmt::format("one of {}, or a file (NAME.ENDING)", quoted_choices<Enum>());
  }

  static Json schema(const Variant&, const Limits& limits) {
    Json schema = Value<std::filesystem::path>::schema({}, limits);
    for (const auto& choice : choices(Enum{})) schema["examples"].push_back(choice.name);
    return schema;
  }

  static Json json(const Variant& value) {
    const Enum* word = std::get_if<Enum>(&value);
    return word ? Value<Enum>::json(*word) : Json(std::get<std::filesystem::path>(value).string());
  }
};

template <class T>
struct Value<std::optional<T>> {
  static bool read(const Json& json, const Limits& limits, std::optional<T>& target) {
    return Value<T>::read(json, limits, target.emplace());
  }
  static std::string expectation(const std::optional<T>&, const Limits& limits) {
    return Value<T>::expectation(T(), limits);
  }
  static Json schema(const std::optional<T>&, const Limits& limits) { return Value<T>::schema(T(), limits); }
  static Json json(const std::optional<T>& value) { return value ? Value<T>::json(*value) : Json(); }
};

/// A short form of `value` for messages.
std::string excerpt(const Json& value);

}  // namespace tensorray
