#pragma once
/// @file tools/command_line/tell.h
/// Prints what the commands say in addition to their results.

#include <string>
#include <vector>

#include <fmt/core.h>

namespace tensorray {

/// Prints `lines` on standard error, unless `quiet` is set.
inline void tell(const std::vector<std::string>& lines, bool quiet) {
  if (quiet) return;
  for (const std::string& line : lines) fmt::print(stderr, "{}\n", line);
}

}  // namespace tensorray
