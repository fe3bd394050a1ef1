#pragma once
/// @file tools/command_line/tell.h
/// What the commands say besides their results.

#include <string>
#include <vector>

#include <fmt/core.h>

namespace tensorray {

/// Prints `lines` on standard error, unless it is to be quiet.
inline void tell(const std::vector<std::string>& lines, bool quiet) {
  if (quiet) return;
  for (const std::string& line : lines) fmt::print(stderr, "{}\n", line);
}

}  // namespace tensorray
