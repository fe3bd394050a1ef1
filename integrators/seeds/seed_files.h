#pragma once
/// @file integrators/seeds/seed_files.h
/// Reads seeds from text files.

#include <filesystem>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

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
