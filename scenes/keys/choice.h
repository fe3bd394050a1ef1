#pragma once
/// @file scenes/keys/choice.h
/// The words by which scene files name the alternatives of an enumeration. `choices(Enum{})` is an array of all
/// alternatives; the argument only selects the overload.

namespace tensorray {

template <class Enum>
struct Choice {
  const char* name;
  Enum value;
};

/// The word for an alternative.
template <class Enum>
const char* choice_name(Enum value) {
  for (const auto& choice : choices(value)) {
    if (choice.value == value) return choice.name;
  }
  return "";
}

}  // namespace tensorray
