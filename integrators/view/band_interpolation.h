#pragma once
/// @file integrators/view/band_interpolation.h
/// The ways of one ray's bands are a smooth function of the wavelength almost everywhere. Some of them are traced, and
/// the others are interpolated where one more that is traced agrees with the interpolation (polynomials of Lagrange
/// through nodes that stand as Chebyshev's).

#include <cstddef>
#include <vector>

#include "renderer/shading/bending_region.h"

namespace tensorray {

/// Ways [first, first + count) of a list, in the order of their bands: those of one ray.
struct BandGroup {
  std::size_t first = 0, count = 0;
  std::vector<std::size_t> nodes;  ///< Indices of the ways that interpolation is made of; ascending.
  std::size_t check = 0;           ///< Index of the way that it must agree with.

  bool is_traced(std::size_t way) const;  ///< Whether the way is a node or the check.
};

/// The rays of which some bands may be interpolated: ways that stand next to each other, start alike, and allow a
/// `tolerance`; at least 6, as fewer would gain too little.
std::vector<BandGroup> interpolation_groups(const std::vector<BentWay>& ways);

/// Whether the nodes predict the check: its direction within its tolerance, its position within the tolerance as seen
/// from `start`, and its compression within 1%. All of them must have been followed, and arrive.
/// @param start  Where the ways of the group started.
bool is_predictable(const BandGroup& group, const std::vector<BentWay>& ways, const Eigen::Vector3d& start);

/// Sets position, direction, compression and `arrives` of the ways that were not traced.
void interpolate(const BandGroup& group, std::vector<BentWay>& ways);

}  // namespace tensorray
