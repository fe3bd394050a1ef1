#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/core.h>

#include "scenes/keys/key_visitor.h"

namespace tensorray {
namespace {

/// Voxels along each axis of `extent`: `longest` along the longest axis, and voxels as close to cubes as possible.
Eigen::Vector3i cubic_resolution(const Eigen::Vector3d& extent, int longest) {
  const double length = extent.maxCoeff();
  if (longest == 1 || !(length > 0)) return Eigen::Vector3i::Ones();
  return ((extent / length * (longest - 1)).array().round() + 1).cast<int>();
}

void check(const GridSettings& grid) {
  if ((grid.max - grid.min).minCoeff() < 0) throw std::invalid_argument("`max` must not be below `min` on any axis");
  if (!(grid.max - grid.min).allFinite()) throw std::invalid_argument("`min` and `max` are too far apart");
  const Eigen::Vector3i& n = grid.resolution;
  if (n.minCoeff() < 1) throw std::invalid_argument("`resolution` must be at least 1 on every axis");
  if (((grid.max - grid.min).array() == 0 && n.array() > 1).any())
    throw std::invalid_argument("`resolution` must be 1 on an axis where `min` and `max` are equal");
  if (n.cast<double>().prod() > voxel_limit) {
    throw std::invalid_argument(
        fmt::format("`resolution` asks for {} x {} x {} voxels, more than 2^31; ask for fewer", n.x(), n.y(), n.z()));
  }
}

}  // namespace

GridSettings choose_grid(const Generator& generator, const GridRequest& request) {
  const auto* each = std::get_if<Eigen::Vector3i>(&request.resolution);
  const int longest = each ? each->maxCoeff() : std::get<int>(request.resolution);
  if (longest < 1) throw std::invalid_argument("`resolution` must be at least 1");

  GridSettings grid = default_grid(generator, std::max(longest, 2));  // With one voxel the box would have no extent.
  if (request.min) grid.min = *request.min;
  if (request.max) grid.max = *request.max;
  grid.levels = request.levels;
  if (each) {
    grid.resolution = *each;
  } else if (request.min || request.max || longest == 1) {
    grid.resolution = cubic_resolution(grid.max - grid.min, longest);
  }
  check(grid);
  return grid;
}

}  // namespace tensorray
