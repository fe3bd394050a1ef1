#pragma once
/// Makes a field of blocks in one pass: each block is read, cleaned, preprocessed and placed in its bricks while it is
/// in the processor's caches, without a grid in between.

#include <optional>
#include <vector>

#include "volumes/bricks/tensor_field.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray {

/// How far linear and cubic interpolation differ in the middles of cells: ‖T_linear − T_cubic‖ (Frobenius) as a part of
/// the root mean square of ‖T_cubic‖ there. Halving the voxels divides it by four where voxels resolve the field.
struct Resolution {
  /// Number of cells that were compared: those with 4³ active voxels about them, or, if there are few, 2³; so that what
  /// interpolation does at the field's border does not count. 0: there are none.
  std::size_t cells = 0;
  double median = 0, percentile_90 = 0, percentile_99 = 0;
};

/// Above these, pictures depend on what was between the voxels and is not known: noise, which is in all cells, or
/// structures about two voxels wide, in a few. Sharp edges of what is resolved are below them.
constexpr double coarse_90 = 0.05, coarse_99 = 0.25;

inline bool is_coarse(const Resolution& resolution) {
  return resolution.percentile_90 > coarse_90 || resolution.percentile_99 > coarse_99;
}

struct MadeField {
  std::optional<TensorField> field;  ///< Nothing if no voxel is finite.
  EigenvalueReport eigenvalues;
  Resolution resolution;                  ///< Of a cubic field.
  std::size_t voxels = 0;                 ///< Active voxels of level 0.
  std::vector<std::size_t> finer_voxels;  ///< Of each finer level.
  std::size_t non_finite = 0;             ///< Active voxels that were not finite and are not in the field.
};

/// The field of `TensorField` after remove_non_finite and apply_eigenvalues, bit for bit. Runs on all threads. Blocks
/// are read a second time if some are not finite, or if `automatic` is not what some of them made it look like.
/// @throw what `source` throws.
MadeField make_field(const BlockSource& source, Eigenvalues mode, const Interpolant& interpolant = {});

}  // namespace tensorray
