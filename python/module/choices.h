#pragma once
/// @file python/module/choices.h
/// Words of scene files as arguments of functions.

#include <stdexcept>
#include <string>

#include "scenes/description/choices.h"
#include "scenes/keys/values.h"

namespace tensorray {

/// The value of a word, as scene files have it. @throw std::invalid_argument that lists the words.
template <class Enum>
Enum value_of(const std::string& argument, const std::string& word) {
  Enum value{};
  if (!Value<Enum>::read(Json(word), {}, value))
    throw std::invalid_argument(argument + " must be " + Value<Enum>::expectation(value, {}));
  return value;
}

}  // namespace tensorray
