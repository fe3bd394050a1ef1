#pragma once
/// @file python/module/choices.h
/// Words of scene files as arguments of functions.

#include <stdexcept>
#include <string>
#include <vector>

#include "base/text/text.h"
#include "scenes/description/choices.h"

namespace tensorray {

/// The value of a word, as scene files have it. @throw std::invalid_argument that lists the words.
template <class Enum>
Enum value_of(const std::string& argument, const std::string& word) {
  std::vector<std::string> known;
  for (const auto& choice : choices(Enum{})) {
    if (word == choice.name) return choice.value;
    known.emplace_back(choice.name);
  }
  throw std::invalid_argument(argument + ": unknown value `" + escaped(word) + "`; there are " + joined(known));
}

}  // namespace tensorray
