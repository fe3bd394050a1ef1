#pragma once
/// @file integrators/paths/seed_files.h
/// Seeds from text files.

#include <filesystem>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Seeds from a file: positions, and directions where the file has them.
struct SeedList {
  std::vector<Eigen::Vector3d> positions;   ///< World.
  std::vector<Eigen::Vector3d> directions;  ///< Unit; one for each position, or none at all.
};

/// Reads text with a point a line: x y z, or x y z dx dy dz for a point with the light's direction, in world
/// coordinates, separated by blanks, commas or semicolons. All lines have equally many numbers. Empty lines and what
/// follows a # are ignored, and so is a first line of as many names (.csv).
/// @throw std::runtime_error naming the file, the line and the mend: unreadable, not a finite number, neither three nor
/// six of them, a direction of length zero, no point.
SeedList read_seeds(const std::filesystem::path& path);

}  // namespace tensorray
