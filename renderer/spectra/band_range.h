#pragma once
/// @file renderer/spectra/band_range.h
/// Some of the bands of the light.

#include <algorithm>
#include <cstddef>
#include <limits>

namespace tensorray {

/// Bands that stand next to each other, such as those whose light a path carries. By default: all.
struct BandRange {
  std::ptrdiff_t first = 0;
  std::ptrdiff_t count = std::numeric_limits<std::ptrdiff_t>::max();  ///< At most.

  /// How many of `bands` bands are in the range.
  std::ptrdiff_t size(std::ptrdiff_t bands) const { return std::min(count, bands - first); }
};

}  // namespace tensorray
