#pragma once
/// @file integrators/paths/seeds.h
/// Positions from which paths are followed.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "renderer/lights/beam.h"

namespace tensorray {

/// On the beam's entry plane, within its aperture: the cells' centres of a lattice, about `count` of them.
/// @throw std::invalid_argument if `count` is 0.
std::vector<Eigen::Vector3d> grid_seeds(const Beam& beam, std::uint64_t count);

/// On the beam's entry plane, uniform within its aperture, exactly `count`, but none nearer to another than
/// 0.75 √(area / count) (70% of the distance in the densest lattice): evenly spread, with no lattice to be seen.
/// Functions of `seed`.
/// @throw std::invalid_argument if `count` is 0 or above 10⁷.
std::vector<Eigen::Vector3d> poisson_disk_seeds(const Beam& beam, std::uint64_t count, std::uint64_t seed);

/// Evenly from one end to the other, both among them; the middle if `count` is 1.
/// @throw std::invalid_argument if `count` is 0.
std::vector<Eigen::Vector3d> line_seeds(const Eigen::Vector3d& from, const Eigen::Vector3d& to, std::uint64_t count);

/// Evenly spread in a ball: the first `count` points of a Sobol sequence, of equal density everywhere.
/// @throw std::invalid_argument if `count` is 0 or above 2³², or the radius is not positive.
std::vector<Eigen::Vector3d> sphere_seeds(const Eigen::Vector3d& center, double radius, std::uint64_t count,
                                          std::uint64_t seed);

}  // namespace tensorray
