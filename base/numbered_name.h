#pragma once
/// @file base/numbered_name.h
/// Names of files of a sequence: # stands for the number of a frame or of a step of time.

#include <string>

namespace tensorray {

/// Whether a name has a number.
inline bool has_number_sign(const std::string& name) { return name.find('#') != std::string::npos; }

/// `text` with each run of the character # replaced by the number, which has at least as many digits:
/// "flow.####.vdb" becomes "flow.0007.vdb".
inline std::string numbered(std::string text, int number) {
  for (std::size_t at = text.find('#'); at != std::string::npos; at = text.find('#')) {
    const std::size_t end = text.find_first_not_of('#', at);
    const std::size_t width = (end == std::string::npos ? text.size() : end) - at;
    std::string digits = std::to_string(number);
    if (digits.size() < width) digits.insert(0, width - digits.size(), '0');
    text.replace(at, width, digits);
  }
  return text;
}

}  // namespace tensorray
