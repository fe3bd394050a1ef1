#pragma once
/// Positions from which paths are followed.

#include <cstdint>
#include <filesystem>
#include <limits>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "renderer/lights/beam.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {

/// The cell centres of a lattice on the beam's entry plane, within its aperture; about `count` of them.
/// @throw std::invalid_argument if `count` is 0.
std::vector<Eigen::Vector3d> grid_seeds(const Beam& beam, std::uint64_t count);

/// Exactly `count` points, uniform on the beam's entry plane within its aperture. No two are nearer than 0.75 √(area /
/// count) (70% of the distance in the densest lattice), which is even but no lattice.
/// @throw std::invalid_argument if `count` is 0 or above 10⁷.
std::vector<Eigen::Vector3d> poisson_disk_seeds(const Beam& beam, std::uint64_t count, std::uint64_t seed);

/// Evenly spaced points from one end to the other, including both; the middle if `count` is 1.
/// @throw std::invalid_argument if `count` is 0.
std::vector<Eigen::Vector3d> line_seeds(const Eigen::Vector3d& from, const Eigen::Vector3d& to, std::uint64_t count);

/// Points of equal density in a ball: the first `count` points of a Sobol sequence.
/// @throw std::invalid_argument if `count` is 0 or above 2³², or the radius is not positive.
std::vector<Eigen::Vector3d> sphere_seeds(const Eigen::Vector3d& center, double radius, std::uint64_t count,
                                          std::uint64_t seed);

/// Selects the tensors whose invariant is from `min` to `max`, both included.
struct Threshold {
  Invariant invariant = Invariant::norm;
  double min = -std::numeric_limits<double>::infinity(), max = std::numeric_limits<double>::infinity();
};

/// Points of equal density in the part of the field's extent where the threshold selects the tensor (inactive voxels
/// count as zero; sampled in single precision): the first `count` points of a Sobol sequence there. Runs on all
/// threads; the result does not depend on their number.
/// @throw std::invalid_argument if `count` is 0 or the threshold is empty, and, with the range of the values found, if
/// none of 2²⁰ points is selected, or fewer than `count` of 2²⁶.
std::vector<Eigen::Vector3d> threshold_seeds(const TensorField& field, const Threshold& threshold, std::uint64_t count,
                                             std::uint64_t seed);

/// Seeds of a file: positions, and directions if the file has them.
struct SeedList {
  std::vector<Eigen::Vector3d> positions;   ///< World.
  std::vector<Eigen::Vector3d> directions;  ///< Unit; one for each position, or empty.
};

/// Reads text with one point in each line: x y z, or x y z dx dy dz for a point with the light's direction, in world
/// coordinates. Blanks, commas or semicolons separate the numbers. All lines have the same number of numbers. Empty
/// lines, text after a #, and a first line of names (.csv) with the same number of words are ignored.
/// @throw std::runtime_error naming the file, the line and the fix: unreadable, not a finite number, neither three nor
/// six of them, a direction of length zero, no point.
SeedList read_seeds(const std::filesystem::path& path);

}  // namespace tensorray
