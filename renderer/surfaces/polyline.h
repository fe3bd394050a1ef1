#pragma once
/// @file renderer/surfaces/polyline.h
/// Leaves out the points of a polyline that can be interpolated from their neighbours.

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace tensorray {

/// Returns which of the points 0 to count − 1 to keep, in order (Ramer 1972; Douglas and Peucker 1973). The first and
/// the last point are always kept.
/// @param error  error(i, j, k) with i < k < j: the difference of point k from the interpolation between i and j, as a
///               multiple of the allowed one. Every point that is left out has at most 1 between its kept neighbours.
template <class Error>
std::vector<std::size_t> thinned(std::size_t count, Error&& error) {
  std::vector<std::size_t> kept;
  if (count == 0) return kept;
  kept.push_back(0);
  if (count == 1) return kept;
  std::vector<std::size_t> ends{count - 1};  // Last points of the pieces still to be checked; the nearest is last.
  while (!ends.empty()) {
    const std::size_t first = kept.back(), last = ends.back();
    std::pair<double, std::size_t> worst{0, 0};
    // An infinite error means that no error is allowed: stop at the first one, or the time is quadratic in the count.
    for (std::size_t k = first + 1; k < last && !std::isinf(worst.first); ++k)
      if (const double e = error(first, last, k); !(e <= worst.first)) worst = {e, k};
    if (worst.first <= 1) {
      kept.push_back(last);
      ends.pop_back();
    } else {
      ends.push_back(worst.second);
    }
  }
  return kept;
}

}  // namespace tensorray
