#pragma once
/// @file scenes/keys/generate_grid.h
/// Chooses the grid on which a generator makes tensors, from the user's keys.

#include <optional>
#include <variant>

#include <Eigen/Core>

#include "scenes/keys/values.h"
#include "volumes/making/generators.h"

namespace tensorray {

/// `field.generate`.
struct GenerateDescription {
  Generator generator;
  GridSettings grid;
};

/// The keys of the grid, in scene files (`field.generate`) and in `tensorray make`.
struct GridRequest {
  /// Voxels along the longest axis of the box (voxels are then cubes); or voxels along x, y and z.
  std::variant<int, Eigen::Vector3i> resolution = 64;
  std::optional<Eigen::Vector3d> min, max;  ///< Centres of the outermost voxels, world; none: the generator's.
};

constexpr int resolution_limit = 32768;       ///< Voxels along an axis.
constexpr double voxel_limit = 2147483648.0;  ///< Voxels of a generated grid: 72 GiB of tensors.

/// The keys of the grid; the generator has further keys.
template <class Visitor>
void describe(GridRequest& grid, Visitor& visit) {
  visit("resolution", grid.resolution,
        "voxels along the longest axis of the box (voxels are then cubes), or along x, y and z",
        between(1, resolution_limit));
  visit("min", grid.min, "least corner of the box, world; default: that of the kind");
  visit("max", grid.max, "greatest corner of the box, world; default: that of the kind");
}

/// @throw std::invalid_argument that names the key: max below min, no voxel, too many voxels.
GridSettings choose_grid(const Generator& generator, const GridRequest& request);

}  // namespace tensorray
