#pragma once
/// @file tools/import/sampling/mesh_blocks.h
/// Fills the blocks of a grid from the cells of a mesh.

#include "base/process/progress.h"
#include "tools/import/meshes/mesh_solid.h"
#include "tools/import/sampling/sampling_lattice.h"
#include "volumes/grids/tensor_grid.h"

class vtkDataSet;

namespace tensorray {

/// What blocks are filled from.
struct MeshSource {
  vtkDataSet& mesh;
  const double* point_tensors;  ///< Nine for each point; null: a cell has its tensor everywhere.
  const double* cell_tensors;   ///< Nine for each cell; may be null. Cells whose tensor is not finite are left out.
  const Solid& solid;
  const SamplingLattice& lattice;
  double tolerance;  ///< Distance from a cell below which a voxel's centre is in it.
};

/// The blocks that may have active voxels, as sample_mesh (mesh_sampling.h) describes them, ordered by origin.
TensorBlocks mesh_blocks(const MeshSource& source, const Progress& progress);

}  // namespace tensorray
