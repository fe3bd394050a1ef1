#pragma once
/// @file integrators/scene/band_interpolation.h
/// Interpolates bands of a ray between bands that were traced. Almost everywhere, the way of light is a smooth function
/// of its wavelength. A Lagrange polynomial through Chebyshev nodes is used if one more traced band agrees with it.

#include <cstddef>
#include <vector>

#include "renderer/lights/bending_region.h"

namespace tensorray {

/// Ways [first, first + count) of a list, in the order of their bands: those of one ray.
struct BandGroup {
  std::size_t first = 0, count = 0;
  std::vector<std::size_t> nodes;  ///< Indices of the ways that interpolation is made of; ascending.
  std::size_t check = 0;           ///< Index of the way that it must agree with.

  bool is_traced(std::size_t way) const;  ///< Whether the way is a node or the check.
};

/// The groups in which ways may be interpolated: 6 or more neighbours that start alike and allow a `tolerance`. Fewer
/// would gain too little.
std::vector<BandGroup> interpolation_groups(const std::vector<BentRay>& ways);

/// Whether the nodes predict the check: its direction within its tolerance, its position within the tolerance as seen
/// from `start`, and its jacobian within 1%. All of these ways must have been traced, and must arrive.
/// @param start  Where the ways of the group started.
bool is_predictable(const BandGroup& group, const std::vector<BentRay>& ways, const Eigen::Vector3d& start);

/// Sets position, direction, jacobian and `arrives` of the ways that were not traced.
void interpolate(const BandGroup& group, std::vector<BentRay>& ways);

}  // namespace tensorray
