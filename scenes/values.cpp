#include "scenes/values.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tensorray {
namespace {

bool within(double number, const Limits& limits) {
  if (!std::isfinite(number) || (limits.not_zero && number == 0)) return false;
  const bool above = limits.minimum_excluded ? number > limits.minimum : number >= limits.minimum;
  return above && number <= limits.maximum;
}

/// Integers may be written as 1e6 or 4.0, as JSON Schema has it. All limits of integers are exact in a double.
template <class Integer>
bool assign_integer(const Json& value, const Limits& limits, Integer& target) {
  if (!value.is_number()) return false;
  const double number = value.get<double>();
  if (number != std::floor(number) || !within(number, limits)) return false;
  target = value.is_number_float() ? static_cast<Integer>(number) : value.get<Integer>();
  return true;
}

template <class Scalar, int size>
bool assign_vector(const Json& value, const Limits& limits, Eigen::Matrix<Scalar, size, 1>& target) {
  Limits each = limits;
  each.not_zero = false;
  if (limits.one_for_all && value.is_number()) {
    if (!assign(value, each, target[0])) return false;
    target.setConstant(target[0]);
    return true;
  }
  if (!value.is_array() || value.size() != size) return false;
  for (int i = 0; i < size; ++i) {
    if (!assign(value[static_cast<std::size_t>(i)], each, target[i])) return false;
  }
  // The square must neither vanish nor overflow: the vector is to be normalised.
  const double square = target.template cast<double>().squaredNorm();
  return !limits.not_zero || (std::isnormal(square) && square > 0);
}

std::string range(const Limits& limits) {
  if (limits.not_zero) return " other than 0";
  if (std::isfinite(limits.maximum)) return fmt::format(" from {} to {}", limits.minimum, limits.maximum);
  if (std::isfinite(limits.minimum)) return fmt::format(" {} {}", limits.minimum_excluded ? ">" : ">=", limits.minimum);
  return "";
}

std::string list_expectation(int size, const char* things, const Limits& limits) {
  Limits each = limits;
  each.not_zero = false;
  const std::string length = limits.not_zero ? ", not all 0" : "";
  const std::string one = limits.one_for_all ? ", or one for all" : "";
  return fmt::format("a list of {} {}{}{}{}", size, things, range(each), length, one);
}

}  // namespace

bool assign(const Json& value, const Limits&, bool& target) {
  if (!value.is_boolean()) return false;
  target = value.get<bool>();
  return true;
}

bool assign(const Json& value, const Limits& limits, int& target) { return assign_integer(value, limits, target); }

bool assign(const Json& value, const Limits& limits, std::uint64_t& target) {
  return assign_integer(value, limits, target);
}

bool assign(const Json& value, const Limits& limits, double& target) {
  if (!value.is_number()) return false;
  target = value.get<double>();
  return within(target, limits);
}

bool assign(const Json& value, const Limits&, std::string& target) {
  if (!value.is_string()) return false;
  target = value.get<std::string>();
  return target.find('\0') == std::string::npos;
}

bool assign(const Json& value, const Limits& limits, std::filesystem::path& target) {
  std::string text;
  if (!assign(value, limits, text) || text.empty()) return false;
  target = text;
  const std::string ending = target.extension().string();
  const auto& allowed = limits.endings;
  return allowed.empty() || std::find(allowed.begin(), allowed.end(), ending) != allowed.end();
}

bool assign(const Json& value, const Limits& limits, Eigen::Vector2i& target) {
  return assign_vector(value, limits, target);
}

bool assign(const Json& value, const Limits& limits, Eigen::Vector3i& target) {
  return assign_vector(value, limits, target);
}

bool assign(const Json& value, const Limits& limits, Eigen::Vector2d& target) {
  return assign_vector(value, limits, target);
}

bool assign(const Json& value, const Limits& limits, Eigen::Vector3d& target) {
  return assign_vector(value, limits, target);
}

bool assign(const Json& value, const Limits& limits, Eigen::Matrix3d& target) {
  if (!value.is_array() || value.size() != 3) return false;
  for (int i = 0; i < 3; ++i) {
    Eigen::Vector3d row;
    if (!assign(value[static_cast<std::size_t>(i)], limits, row)) return false;
    target.row(i) = row;
  }
  return true;
}

bool assign(const Json& value, const Limits& limits, std::vector<double>& target) {
  const Json list = value.is_array() ? value : Json::array({value});
  target.resize(list.size());
  for (std::size_t i = 0; i < target.size(); ++i)
    if (!assign(list[i], limits, target[i])) return false;
  return !target.empty();
}

bool assign(const Json& value, const Limits& limits, std::variant<int, Eigen::Vector3i>& target) {
  if (value.is_array()) return assign(value, limits, target.emplace<Eigen::Vector3i>());
  return assign(value, limits, target.emplace<int>());
}

std::string expectation(const bool&, const Limits&) { return "true or false"; }

std::string expectation(const int&, const Limits& limits) { return "an integer" + range(limits); }

std::string expectation(const std::uint64_t&, const Limits& limits) { return "an integer" + range(limits); }

std::string expectation(const double&, const Limits& limits) { return "a number" + range(limits); }

std::string expectation(const std::string&, const Limits&) { return "a string"; }

std::string expectation(const std::filesystem::path&, const Limits& limits) {
  std::string endings;
  for (const std::string& ending : limits.endings) endings += (endings.empty() ? " ending in " : " or ") + ending;
  return "a file name" + endings;
}

std::string expectation(const Eigen::Vector2i&, const Limits& limits) {
  return list_expectation(2, "integers", limits);
}

std::string expectation(const Eigen::Vector3i&, const Limits& limits) {
  return list_expectation(3, "integers", limits);
}

std::string expectation(const Eigen::Vector2d&, const Limits& limits) { return list_expectation(2, "numbers", limits); }

std::string expectation(const Eigen::Vector3d&, const Limits& limits) { return list_expectation(3, "numbers", limits); }

std::string expectation(const Eigen::Matrix3d&, const Limits&) { return "a list of 3 rows of 3 numbers"; }

std::string expectation(const std::vector<double>&, const Limits& limits) {
  return expectation(double(), limits) + ", or a list of them";
}

std::string expectation(const std::variant<int, Eigen::Vector3i>&, const Limits& limits) {
  return expectation(int(), limits) + ", or a list of 3 of them";
}

std::string excerpt(const Json& value) {
  constexpr std::size_t longest = 60;
  const std::string text = value.dump(-1, ' ', true);
  return text.size() <= longest ? text : text.substr(0, longest) + "...";
}

}  // namespace tensorray
