#pragma once
/// @file scenes/keys/limits.h
/// What a value in a scene file must satisfy beyond its type.

#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace tensorray {

/// Constraints on one key. Those that do not apply to the key's type are ignored.
struct Limits {
  double minimum = -std::numeric_limits<double>::infinity();  ///< Of a number, or of each number of a list.
  double maximum = std::numeric_limits<double>::infinity();
  bool minimum_excluded = false;
  bool not_zero = false;               ///< A number other than 0; a vector whose length is not 0.
  bool one_for_all = false;            ///< One number may stand for a list of equal ones.
  const char* word = nullptr;          ///< "auto": a string allowed instead, read as 0 or no value.
  std::vector<std::string> endings{};  ///< Of a file name, one of these; empty: any.

  Limits or_word(const char* allowed) && {
    word = allowed;
    return std::move(*this);
  }
  Limits or_one_for_all() && {
    one_for_all = true;
    return std::move(*this);
  }
};

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

}  // namespace tensorray
