#pragma once
/// @file scenes/keys/generate_grid.h
/// The grid on which a generator samples, from what the user asked for.

#include <optional>
#include <variant>

#include <Eigen/Core>

#include "scenes/keys/limits.h"
#include "volumes/tensors/generators.h"

namespace tensorray {

/// `field.generate`.
struct GenerateDescription {
  Generator generator;
  GridSettings grid;
};

/// What scene files (`field.generate`) and `tensorray make` say of the grid. What is not given is the generator's.
struct GridRequest {
  /// Voxels along the longest axis of the box, all voxels cubes; or voxels along x, y and z.
  std::variant<int, Eigen::Vector3i> resolution = 64;
  std::optional<Eigen::Vector3d> min, max;  ///< World; centres of the outermost voxels.
};

constexpr int resolution_limit = 32768;       ///< Voxels along an axis.
constexpr double voxel_limit = 2147483648.0;  ///< Voxels of a generated grid: 72 GiB of tensors.

/// The grid's keys beside those of the generator. For visitors see scenes/description/scene_keys.h.
template <class Visitor>
void describe(GridRequest& grid, Visitor& visit) {
  visit("resolution", grid.resolution,
        "voxels along the longest axis of the box (voxels are then cubes), or along x, y and z",
        between(1, resolution_limit));
  visit("min", grid.min, "least corner of the box, world; without it the kind's own");
  visit("max", grid.max, "greatest corner of the box, world; without it the kind's own");
}

/// @throw std::invalid_argument that names the key: max below min, no voxel, too many voxels.
GridSettings choose_grid(const Generator& generator, const GridRequest& request);

}  // namespace tensorray
