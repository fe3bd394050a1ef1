#pragma once
/// @file scenes/generate_grid.h
/// The grid on which a generator samples, from what the user asked for.

#include <optional>
#include <variant>

#include <Eigen/Core>

#include "volumes/tensors/generators.h"

namespace tensorray {

/// What scene files (`field.generate`) and `tensorray make` say of the grid. What is not given is the generator's.
struct GridRequest {
  /// Voxels along the longest axis of the box, all voxels cubes; or voxels along x, y and z.
  std::variant<int, Eigen::Vector3i> resolution = 64;
  std::optional<Eigen::Vector3d> min, max;  ///< World; centres of the outermost voxels.
};

constexpr int resolution_limit = 32768;       ///< Voxels along an axis.
constexpr double voxel_limit = 2147483648.0;  ///< Voxels of a generated grid: 72 GiB of tensors.

/// @throw std::invalid_argument that names the key: max below min, no voxel, too many voxels.
GridSettings choose_grid(const Generator& generator, const GridRequest& request);

}  // namespace tensorray
