#pragma once
/// @file integrators/seeds/seeds.h
/// Positions from which paths are followed.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "renderer/lights/beam.h"

namespace tensorray {

/// The cell centres of a lattice on the beam's entry plane, within its aperture; about `count` of them.
/// @throw std::invalid_argument if `count` is 0.
std::vector<Eigen::Vector3d> grid_seeds(const Beam& beam, std::uint64_t count);

/// Exactly `count` points, uniform on the beam's entry plane within its aperture. No two are nearer than 0.75 √(area /
/// count) (70% of the distance in the densest lattice), so that they are evenly spread but show no lattice. The result
/// depends only on the arguments.
/// @throw std::invalid_argument if `count` is 0 or above 10⁷.
std::vector<Eigen::Vector3d> poisson_disk_seeds(const Beam& beam, std::uint64_t count, std::uint64_t seed);

/// Evenly spaced points from one end to the other, including both; the middle if `count` is 1.
/// @throw std::invalid_argument if `count` is 0.
std::vector<Eigen::Vector3d> line_seeds(const Eigen::Vector3d& from, const Eigen::Vector3d& to, std::uint64_t count);

/// Points of equal density in a ball: the first `count` points of a Sobol sequence.
/// @throw std::invalid_argument if `count` is 0 or above 2³², or the radius is not positive.
std::vector<Eigen::Vector3d> sphere_seeds(const Eigen::Vector3d& center, double radius, std::uint64_t count,
                                          std::uint64_t seed);

}  // namespace tensorray
