#pragma once
/// @file tools/import/meshes/mesh_sampling.h
/// From tensors on a mesh to tensors on a lattice.

#include <cstddef>
#include <optional>
#include <variant>

#include <Eigen/Geometry>

#include "base/progress.h"
#include "volumes/grids/tensor_grid.h"

class vtkDataSet;

namespace tensorray {

struct SamplingSettings {
  /// Voxels along the longest edge, or along x, y, z (>= 2 each); or a voxel's edge; or none of these: chosen so that
  /// the median cell is about a voxel, within 2^21 voxels.
  std::variant<std::monostate, int, Eigen::Vector3i, double> resolution;
  std::optional<Eigen::AlignedBox3d> bounds;  ///< World; default: those of the three-dimensional cells.
};

struct SamplingReport {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();   ///< Voxels of the lattice, active or not.
  Eigen::Vector3d voxel = Eigen::Vector3d::Zero();  ///< Edges of a voxel.
  std::size_t active = 0;
  double native_peak = 0, native_median = 0;    ///< Of ‖T‖ (Frobenius) at the cells' points in `bounds`.
  double sampled_peak = 0, sampled_median = 0;  ///< At the active voxels.
  std::size_t non_finite_points = 0;            ///< Of the cells' points in `bounds`.
};

/// Samples the tensors of with_tensors at the voxels' centres, by the interpolation of the cell that each is in (where
/// cells overlap, the one of the lowest index); voxels in no cell, or in one with a NaN at a point that counts, are
/// inactive. Voxels have the middle of the box as their middle as far as the box goes, and those within 1e-6 of the
/// mesh's diagonal of a face count as inside. On all threads, with the same result on any number.
/// @throw std::invalid_argument if the mesh has no three-dimensional cells, a setting is out of range, no voxel is
/// inside, or the grid would exceed 2^30 voxels.
TensorGrid sample_mesh(vtkDataSet& mesh, const SamplingSettings& settings, const Progress& progress,
                       SamplingReport& report);

}  // namespace tensorray
