#pragma once
/// @file tools/bytes_text.h
/// Sizes of files and memory, for people.

#include <string>

#include <fmt/core.h>

namespace tensorray {

/// "693.0 KiB", "1.5 MiB", "2.3 GiB".
inline std::string bytes_text(double bytes) {
  if (bytes < 1 << 20) return fmt::format("{:.1f} KiB", bytes / (1 << 10));
  if (bytes < 1 << 30) return fmt::format("{:.1f} MiB", bytes / (1 << 20));
  return fmt::format("{:.1f} GiB", bytes / (1 << 30));
}

}  // namespace tensorray
