#pragma once
/// @file scenes/keys/choice.h
/// Names in scene files for the values of an enumeration. `choices(Enum{})` returns an array of all values and their
/// names; its argument only selects the overload.

namespace tensorray {

template <class Enum>
struct Choice {
  const char* name;
  Enum value;
};

/// The name of a value.
template <class Enum>
const char* choice_name(Enum value) {
  for (const auto& choice : choices(value)) {
    if (choice.value == value) return choice.name;
  }
  return "";
}

}  // namespace tensorray
