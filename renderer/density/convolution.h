#pragma once
/// @file renderer/density/convolution.h
/// Convolution with an even filter. Uses the widest vectors of the processor, chosen at run time.

#include <cstddef>
#include <vector>

namespace tensorray {

/// Values are computed in groups of this size: counts are rounded up to a multiple of it.
constexpr std::size_t convolution_group = 32;

inline std::size_t convolution_room(std::size_t count) {
  return (count + convolution_group - 1) / convolution_group * convolution_group;
}

/// Sets out[i] = Σ_k filter[k] in[i + k step] for i in [0, count).
/// @param filter  An odd number 2 r + 1 of values; even: filter[r − k] == filter[r + k].
/// @param in      Must be readable up to in[convolution_room(count) + 2 r step − 1].
/// @param out     Has room for convolution_room(count) values; must not overlap `in`.
void convolve(const double* in, std::size_t step, const std::vector<double>& filter, double* out, std::size_t count);

}  // namespace tensorray
