#pragma once
/// Samples tensors on a mesh at the voxels of a lattice.

#include <optional>
#include <variant>
#include <vector>

#include <Eigen/Geometry>

#include "base/process/progress.h"
#include "volumes/grids/tensor_grid.h"

class vtkDataSet;

namespace tensorray {

struct SamplingSettings {
  /// The number of voxels along the longest edge (int), the numbers along x, y, z (>= 2 each), or the edge of a voxel
  /// (double). If none is given, a voxel is about as large as the median cell, with at most 2^21 voxels, of which at
  /// least five are across the box; on level 0 it is larger by a power of two where that fits the large cells. Along
  /// each axis, all of them are a little smaller, so that voxels are on both faces of the box.
  std::variant<std::monostate, int, Eigen::Vector3i, double> resolution;
  std::optional<int> levels;     ///< At most so many, 1 to max_levels; none: max_levels.
  std::optional<double> finest;  ///< The least edge of a voxel; none: that of the last level.
  std::optional<double> error;   ///< Of ‖T‖, as a part of the mesh's peak, from which on bricks are refined.
  double rounding = 0;  ///< Of components, to this part of the mesh's median ‖T‖ at most; of levels, twice that each.
  std::optional<Eigen::AlignedBox3d> bounds;  ///< World; default: bounds of the three-dimensional cells.
  double thickness =
      0;               ///< Of the body: twice its volume by its area; 0: not known. A thin one has four voxels across.
  int flat_axis = -1;  ///< The axis across a slab (flat_mesh.h), along which there is one voxel; -1: none.
};

/// A level of finer voxels.
struct LevelReport {
  double voxel = 0;
  std::size_t active = 0, bricks = 0;  ///< Bricks of the level before that it refines.
};

struct SamplingReport {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();   ///< Voxels of the lattice along each axis, active or not.
  Eigen::Vector3d voxel = Eigen::Vector3d::Zero();  ///< Edges of a voxel, world units.
  std::size_t active = 0;
  bool of_cells = false;                      ///< Whether the mesh has its tensors at cells, else at points.
  double native_peak = 0, native_median = 0;  ///< ‖T‖ (Frobenius) of the used cells, or their points, in `bounds`.
  double sampled_peak = 0, sampled_median = 0;  ///< ‖T‖ at the active voxels.
  std::size_t overlaid = 0;                     ///< Voxels that lie in several blocks, which overlap.
  std::vector<LevelReport> finer;               ///< Levels from 1 on.
  double volume = 0;                            ///< Of the active voxels of level 0, world units.
  double wanted_error = 0;                      ///< That was given or chosen.
  bool is_too_large = false;                    ///< Whether a level is left out, as it would have too many voxels.
  std::size_t non_finite = 0;                   ///< Of those cells or points: whose tensor is not finite.
};

/// Samples the tensors of with_tensors at the voxels of a lattice. A voxel is active if its centre is in a cell whose
/// tensor is finite; where cells overlap, the cell with the lowest index counts. Where layers overlap (layer_array),
/// the smallest cell with a finite tensor counts, and a voxel takes its value from one layer. Voxels within 1e-6 of the
/// mesh's diagonal of a face count as inside. The lattice is from face to face of the box.
///
/// A voxel takes the tensor at its centre, interpolated in the cell that contains it (it is NaN if a point with a
/// weight has NaN), or the cell's own if the mesh has tensors at cells alone. Where cells are thinner than voxels, it
/// takes the average over the part of the voxel that the mesh fills (voxel_average.h). The average counts fully where
/// the thinnest of these cells has at most half the thickness of a voxel, then less, and not at all from the thickness
/// of a voxel on. If the mesh has tensors at points and cells, the points' are sampled, and the cells' are those of the
/// file: the report compares with them, and cells where they are not finite are left out.
/// Threads: uses all threads. The result does not depend on their number.
/// @throw std::invalid_argument if the mesh has no three-dimensional cells, a setting is out of range, no voxel is
/// inside, or the grid would exceed 2^30 voxels.
TensorGrid sample_mesh(vtkDataSet& mesh, const SamplingSettings& settings, const Progress& progress,
                       SamplingReport& report);

}  // namespace tensorray
