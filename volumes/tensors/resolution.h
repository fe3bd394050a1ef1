#pragma once
/// @file volumes/tensors/resolution.h
/// How well voxels resolve a field.

#include <cstddef>
#include <vector>

#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// How far linear and cubic interpolation differ in the middles of cells: ‖T_linear − T_cubic‖ (Frobenius) as a part of
/// the root mean square of ‖T_cubic‖ there. Halving the voxels divides it by four where voxels resolve the field.
struct Resolution {
  std::size_t cells = 0;  ///< Number of cells that were compared; 0: none has eight active voxels.
  double median = 0, percentile_99 = 0;
};

/// Above this, pictures depend on what was between the voxels and is not known: structures are about two voxels wide.
constexpr double coarse = 0.1;

inline bool is_coarse(const Resolution& resolution) { return resolution.percentile_99 > coarse; }

/// @param field   A cubic field.
/// @param shapes  Of its blocks. Cells between blocks are not compared.
/// @param count   Greatest number of cells; they are taken evenly from all blocks.
/// Runs on all threads; the result does not depend on their number.
Resolution measure_resolution(const TensorField& field, const std::vector<BlockShape>& shapes, std::size_t count);

}  // namespace tensorray
