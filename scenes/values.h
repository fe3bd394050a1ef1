#pragma once
/// @file scenes/values.h
/// A JSON value → a member of a description, with its limits. One overload a type.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <fmt/core.h>

#include "scenes/choices.h"
#include "scenes/json_reader.h"
#include "scenes/limits.h"

namespace tensorray {

// assign(value, limits, target) sets `target`, or returns false (and may have changed it) if `value` is of another
// type or breaks a limit. expectation(target, limits) says what would have been right: "an integer >= 1".

bool assign(const Json& value, const Limits& limits, bool& target);
bool assign(const Json& value, const Limits& limits, int& target);
bool assign(const Json& value, const Limits& limits, std::uint64_t& target);
bool assign(const Json& value, const Limits& limits, double& target);
bool assign(const Json& value, const Limits& limits, std::string& target);
bool assign(const Json& value, const Limits& limits, std::filesystem::path& target);
bool assign(const Json& value, const Limits& limits, Eigen::Vector2i& target);
bool assign(const Json& value, const Limits& limits, Eigen::Vector3i& target);
bool assign(const Json& value, const Limits& limits, Eigen::Vector2d& target);
bool assign(const Json& value, const Limits& limits, Eigen::Vector3d& target);
bool assign(const Json& value, const Limits& limits, Eigen::Matrix3d& target);
bool assign(const Json& value, const Limits& limits, std::vector<double>& target);  // Or one number.
bool assign(const Json& value, const Limits& limits, std::variant<int, Eigen::Vector3i>& target);

std::string expectation(const bool&, const Limits& limits);
std::string expectation(const int&, const Limits& limits);
std::string expectation(const std::uint64_t&, const Limits& limits);
std::string expectation(const double&, const Limits& limits);
std::string expectation(const std::string&, const Limits& limits);
std::string expectation(const std::filesystem::path&, const Limits& limits);
std::string expectation(const Eigen::Vector2i&, const Limits& limits);
std::string expectation(const Eigen::Vector3i&, const Limits& limits);
std::string expectation(const Eigen::Vector2d&, const Limits& limits);
std::string expectation(const Eigen::Vector3d&, const Limits& limits);
std::string expectation(const Eigen::Matrix3d&, const Limits& limits);
std::string expectation(const std::vector<double>&, const Limits& limits);
std::string expectation(const std::variant<int, Eigen::Vector3i>&, const Limits& limits);

template <class Enum>
std::enable_if_t<std::is_enum_v<Enum>, bool> assign(const Json& value, const Limits&, Enum& target) {
  for (const auto& choice : choices(target)) {
    if (value != choice.name) continue;
    target = choice.value;
    return true;
  }
  return false;
}

template <class Enum>
std::enable_if_t<std::is_enum_v<Enum>, std::string> expectation(const Enum& target, const Limits&) {
  std::string names;
  for (const auto& choice : choices(target)) names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", choice.name);
  return choices(target).size() == 1 ? names : "one of " + names;
}

template <class T>
bool assign(const Json& value, const Limits& limits, std::optional<T>& target) {
  target.emplace();
  return assign(value, limits, *target);
}

template <class T>
std::string expectation(const std::optional<T>&, const Limits& limits) {
  return expectation(T(), limits);
}

/// `value` as it may stand in a message: short.
std::string excerpt(const Json& value);

}  // namespace tensorray
