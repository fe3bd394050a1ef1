#pragma once
/// @file renderer/surfaces/polyline.h
/// Leaves out the points of a polyline that its neighbours imply.

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace tensorray {

/// Which of the points 0 to count − 1 to keep (Ramer 1972; Douglas and Peucker 1973), in order; always the first and
/// the last. @param error  error(i, j, k), i < k < j, says by how much point k differs from what is interpolated
/// between i and j, in units of what is allowed: no point that is left out has more than 1 between its kept neighbours.
template <class Error>
std::vector<std::size_t> thinned(std::size_t count, Error&& error) {
  std::vector<std::size_t> kept;
  if (count == 0) return kept;
  kept.push_back(0);
  if (count == 1) return kept;
  std::vector<std::size_t> ends{count - 1};  // Of the pieces still to be judged, the nearest last.
  while (!ends.empty()) {
    const std::size_t first = kept.back(), last = ends.back();
    std::pair<double, std::size_t> worst{0, 0};
    // Where nothing is allowed, the first difference decides: to look on would take time quadratic in the count.
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
