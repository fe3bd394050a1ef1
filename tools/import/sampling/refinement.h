#pragma once
/// Where a level becomes finer: in bricks with cells that are smaller than its voxels, where it misses the mesh.

#include <vector>

#include "tools/import/sampling/block_places.h"
#include "tools/import/sampling/sampling_lattice.h"

namespace tensorray {

/// The size of the cells, world units: their thickness at each point of the mesh, as a mean of the cells about it (of
/// which few may be slivers), or of each cell if tensors are at cells alone. 0 where there are none.
std::vector<float> cell_sizes(const MeshSource& source);

/// A level that has been sampled.
struct SampledLevel {
  const MeshSource& source;  ///< With its lattice.
  const BlockPlaces& places;
  const TensorBlocks& blocks;
};

/// The boxes of the cells that a level misses: one of their points (or they, if tensors are at cells alone) is where
/// cells are smaller than voxels by more than rounding to a power of two, and where the voxels give a tensor that
/// differs from the mesh's by more than `tolerance` (Frobenius; < 0: by anything). Between voxels that is cubic
/// interpolation; where some of its 4³ voxels are not active, a linear function fitted to the others, so that linear
/// fields need no finer voxels up to a body's surface. Uses all threads; the result does not depend on their number.
std::vector<Eigen::AlignedBox3d> missed_cells(const SampledLevel& level, const std::vector<float>& sizes,
                                              double tolerance);

/// Of each block of a level, by its number, whether its brick is to be refined: a cell that the level misses is in it,
/// or up to two voxels beside it.
std::vector<bool> bricks_to_refine(const SamplingLattice& lattice, const BlockPlaces& places,
                                   const std::vector<Eigen::AlignedBox3d>& missed);

}  // namespace tensorray
