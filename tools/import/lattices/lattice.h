#pragma once
/// @file tools/import/lattices/lattice.h
/// Numbers at the voxels of a lattice, as a file of voxels has them, on their way to a tensor grid.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include <Eigen/Geometry>

#include "tools/import/lattices/tensor_order.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// A lattice's numbers stay where they are until they are asked for, slice by slice from the last z to the first, so
/// that a reader may give back the memory of what it has handed over: an import needs little more than its result.
struct Lattice {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();          ///< Voxels along each axis; >= 1.
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();  ///< From voxel indices (0 ...) to world; invertible.
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();     ///< From the axes of the components to world axes.

  /// In the place of `frame` where the user says that the order is `fsl`: FSL and MRtrix write the same kind of file,
  /// with components in the image's axes and in world axes. The order tells which, as nothing else in the file does.
  std::optional<Eigen::Matrix3d> fsl_frame;

  std::string array;                 ///< Name of what the numbers are; may be empty.
  int components = 0;                ///< Numbers a voxel, the mask included.
  bool masked = false;               ///< The first component is a mask: below one half, the voxel is inactive.
  bool zero_is_background = false;   ///< Voxels of which all components are exactly zero are inactive.
  std::optional<TensorOrder> order;  ///< Where the format itself says it.

  /// Puts the numbers of slice `z`, x fastest, one voxel's components side by side: size.x() * size.y() * components.
  /// Called once for each z, from size.z() − 1 down to 0. @throw std::runtime_error naming the file.
  std::function<void(int z, double* values)> read_slice;
};

/// What became of the voxels.
struct LatticeReport {
  std::size_t voxels = 0, active = 0;
  std::size_t non_finite = 0;  ///< Made inactive, for a component was NaN or infinite.
  std::size_t background = 0;  ///< Inactive by the mask, or by being exactly zero.
};

/// The tensors of a lattice with six or nine components (seven or ten if masked; of more than nine components the first
/// six are the tensor and the others derived from it), in world axes: T = F C Fᵀ with the frame F, which need not be a
/// rotation. Voxel (i, j, k) of the lattice is that of the grid. A grid without an active voxel is no error.
/// @param order  Used where the lattice does not say its own; six components and neither is an error.
/// Memory: the grid, a slice in double precision, and the blocks of eight slices. On all threads, while read_slice is
/// called by one; the same result on any number.
/// @throw std::invalid_argument naming the mend (--order; another array), or whatever read_slice throws.
TensorGrid tensors_of(const Lattice& lattice, const std::optional<TensorOrder>& order, LatticeReport& report);

/// T(i, j) = ∂v_i/∂x_j of a lattice of three components (four if masked), world axes: v = F c with the frame F, by the
/// differences of finite_differences.h. @throw std::invalid_argument naming the mend, or whatever read_slice throws.
TensorGrid gradient_of(const Lattice& lattice, LatticeReport& report);

}  // namespace tensorray
