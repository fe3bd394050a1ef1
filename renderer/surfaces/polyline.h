#pragma once
/// Leaves out the points of a polyline that can be interpolated from their neighbours.

#include <vector>

namespace tensorray {

/// The point between two others that interpolation between these misses most.
struct Worst {
  double error = 0;  ///< As a multiple of the allowed one.
  std::size_t point = 0;
};

/// Which of the points 0 to count − 1 to keep, in order, with both ends (Ramer 1972; Douglas and Peucker 1973).
/// @param worst  worst(i, j): of the points between i and j. Every point that is left out has an error of at most 1
///               between its kept neighbours. Where no error is allowed, `worst` should return the first point that has
///               one, or the time is quadratic in the count.
template <class FindWorst>
std::vector<std::size_t> thinned(std::size_t count, FindWorst&& worst) {
  std::vector<std::size_t> kept;
  if (count == 0) return kept;
  kept.push_back(0);
  if (count == 1) return kept;
  std::vector<std::size_t> ends{count - 1};  // Last points of the pieces still to be checked; the nearest is last.
  while (!ends.empty()) {
    const std::size_t last = ends.back();
    const Worst found = worst(kept.back(), last);
    if (found.error <= 1) {
      kept.push_back(last);
      ends.pop_back();
    } else {
      ends.push_back(found.point);
    }
  }
  return kept;
}

}  // namespace tensorray
