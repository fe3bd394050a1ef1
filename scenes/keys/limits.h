#pragma once
/// @file scenes/keys/limits.h
/// Limits of values in a scene file, in addition to their types.

#include <limits>
#include <string>
#include <utility>
#include <vector>

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

}  // namespace tensorray
