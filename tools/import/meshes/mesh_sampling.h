#pragma once
/// @file tools/import/meshes/mesh_sampling.h
/// Samples tensors on a mesh at the voxels of a lattice.

#include <cstddef>
#include <optional>
#include <variant>

#include <Eigen/Geometry>

#include "base/progress.h"
#include "volumes/grids/tensor_grid.h"

class vtkDataSet;

namespace tensorray {

struct SamplingSettings {
  /// The number of voxels along the longest edge (int), the numbers along x, y, z (>= 2 each), or the edge of a voxel
  /// (double). If none is given, a voxel is about as large as the median cell, with at most 2^21 voxels.
  std::variant<std::monostate, int, Eigen::Vector3i, double> resolution;
  std::optional<Eigen::AlignedBox3d> bounds;  ///< World; default: bounds of the three-dimensional cells.
  int flat_axis = -1;  ///< The axis across a slab (flat_mesh.h), along which there is one voxel; -1: none.
};

struct SamplingReport {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();   ///< Voxels of the lattice along each axis, active or not.
  Eigen::Vector3d voxel = Eigen::Vector3d::Zero();  ///< Edges of a voxel, world units.
  std::size_t active = 0;
  double native_peak = 0, native_median = 0;    ///< ‖T‖ (Frobenius) at the cells' points in `bounds`.
  double sampled_peak = 0, sampled_median = 0;  ///< ‖T‖ at the active voxels.
  std::size_t non_finite_points = 0;            ///< Points of cells in `bounds` whose tensor is not finite.
};

/// Samples the tensors of with_tensors at the centres of voxels. Each voxel uses the interpolation of the cell that
/// contains it; where cells overlap, the cell with the lowest index. A voxel is inactive if it is in no cell, or if a
/// point with a weight has NaN. The lattice is centred in the box as far as the box extends. Voxels within 1e-6 of
/// the mesh's diagonal of a face count as inside.
/// Threads: uses all threads. The result does not depend on their number.
/// @throw std::invalid_argument if the mesh has no three-dimensional cells, a setting is out of range, no voxel is
/// inside, or the grid would exceed 2^30 voxels.
TensorGrid sample_mesh(vtkDataSet& mesh, const SamplingSettings& settings, const Progress& progress,
                       SamplingReport& report);

}  // namespace tensorray
