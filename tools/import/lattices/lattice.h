#pragma once
/// Numbers at the voxels of a lattice, as read from a file of voxels, before they become a tensor grid.

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "tools/import/lattices/tensor_order.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// The axes that programs of medical images refer the components of vectors and tensors to.
enum class ComponentFrame {
  ras,     ///< World axes: right, anterior, superior. MRtrix.
  lps,     ///< Left, posterior, superior. Displacements of ITK and ANTs.
  voxels,  ///< The axes of the voxels. Tensors of ANTs and dipy.
  fsl,     ///< The axes of the voxels, the first one reversed if the image is stored left to right. FSL.
};

/// Those that users can choose, with their names: "ras", "lps", "voxels", "fsl".
const std::vector<std::pair<std::string, ComponentFrame>>& component_frames();

/// From the axes of the components to RAS, an orthogonal matrix: c in RAS = F c.
/// @param to_ras  The linear part of the transform from voxel indices to RAS. If it shears, the axes of the voxels are
/// the rotation (or rotation with a reflection) nearest to their directions.
Eigen::Matrix3d axes_of(ComponentFrame frame, const Eigen::Matrix3d& to_ras);

/// The numbers are read slice by slice, from the last z to the first, so that a reader can free each slice that it
/// has delivered: an import needs little more memory than its result.
struct Lattice {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();          ///< Voxels along each axis; >= 1.
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();  ///< From voxel indices (0 ...) to world; invertible.
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();     ///< From the axes of the components to world axes.

  /// With the orders `fsl` and `lower_triangle`, components are in FSL's axes or in those of the voxels, not in
  /// `frame`: FSL, dipy and MRtrix write the same kind of file. Only the order tells them apart, unless the user gives
  /// the frame.
  bool order_tells_frame = false;
  std::string frame_note;    ///< Where the file leaves `frame` open: how it was taken, for the user.
  bool takes_frame = false;  ///< World is RAS and the file does not state `frame`: the user may (take_frame).

  bool is_anatomical = false;        ///< World is RAS in millimetres, as the file says.
  std::string array;                 ///< Name of the quantity; may be empty.
  int components = 0;                ///< Numbers per voxel, including the mask.
  bool masked = false;               ///< The first component is a mask: the voxel is inactive where it is below 0.5.
  bool zero_is_background = false;   ///< Voxels whose components are all exactly zero are inactive.
  std::optional<TensorOrder> order;  ///< Set where the format defines the order.
  std::optional<TensorOrder> usual_order;  ///< Used where neither the format nor the user says it.
  std::vector<std::string> notes;          ///< What the file leaves open, and how it was taken: for the user.

  /// Writes the numbers of slice `z` to `values`: x fastest, the components of a voxel side by side, size.x() *
  /// size.y() * components numbers in all. Called once for each z, from size.z() − 1 down to 0.
  /// @throw std::runtime_error naming the file.
  std::function<void(int z, double* values)> read_slice;
};

/// Tensors or vectors that are what programs write where they have no data: a component of 1e18 or more (1e20, 1e30,
/// netCDF's 9.97e36, the greatest float: also weighted by interpolation); or all components are one whole number of
/// nines (-999, -9999, ...) or the least integer of 16 or 32 bits.
struct FillValues {
  std::size_t count = 0;
  double example = 0;

  void add(const double* components, int size);
};

/// Counts of the voxels.
struct LatticeReport {
  std::size_t voxels = 0, active = 0;
  std::size_t non_finite = 0;      ///< Made inactive, because a component was NaN or infinite.
  std::size_t background = 0;      ///< Inactive because of the mask, or because they are exactly zero.
  FillValues fills;                ///< Of the active voxels.
  double negative = 0;             ///< Of an anatomical file whose order the user gave: the part of the active voxels
                                   ///< that have a negative eigenvalue.
  std::vector<std::string> notes;  ///< Those of the lattice.
};

/// Sets the axes of the components to those that the user gives.
/// @throw std::invalid_argument naming the fix, if the file states them.
void take_frame(Lattice& lattice, ComponentFrame frame);

/// The tensors, in world axes, of a lattice with six or nine components (seven or ten if masked). If there are more
/// than nine components, the first six are the tensor, and the others are derived from it. T = F C Fᵀ with the frame
/// F, which need not be a rotation. Voxel (i, j, k) of the grid is voxel (i, j, k) of the lattice. A grid without
/// active voxels is not an error.
/// @param order  Used where the lattice has no order. Six components without any order are an error.
/// Memory: the grid, a slice in double precision, and the blocks of eight slices; the grid is in pages (page_memory.h).
/// Threads: uses all threads, but calls read_slice from one. The result does not depend on their number.
/// @throw std::invalid_argument naming the fix (--order, or another array), or whatever read_slice throws.
TensorGrid tensors_of(const Lattice& lattice, const std::optional<TensorOrder>& order, LatticeReport& report);

/// T(i, j) = ∂v_i/∂x_j, in world axes, of a lattice of three components c (four if masked): v = F c with the frame F,
/// differentiated as in finite_differences.h.
/// @throw std::invalid_argument naming the fix, or whatever read_slice throws.
TensorGrid gradient_of(const Lattice& lattice, LatticeReport& report);

}  // namespace tensorray
