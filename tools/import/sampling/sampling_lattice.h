#pragma once
/// What of a mesh is sampled, the lattice of voxels at which it is, and the blocks of the grid that result.

#include <vector>

#include <Eigen/Geometry>

#include "tools/import/sampling/block_places.h"
#include "tools/import/sampling/mesh_sampling.h"

namespace tensorray {

/// The three-dimensional part of a mesh.
struct Solid {
  std::vector<Eigen::AlignedBox3d> boxes;  ///< Box of each cell of the mesh; empty for cells that are not used.
  std::vector<float> thickness;            ///< Of each used cell, world units: MeshCell::thickness.
  std::vector<float> edges;                ///< Of each used cell: MeshCell::edge.
  std::vector<int> coarseness;             ///< Of cells: 0 for the largest, −4 for half of its edge, ...
  Eigen::AlignedBox3d bounds;              ///< Bounds of the points of the used cells.
  std::vector<bool> points;                ///< For each point of the mesh: whether a used cell has it.
};

/// Uses all threads. Afterwards several threads may load cells of `mesh`.
/// @throw std::invalid_argument if the mesh has no three-dimensional cells.
Solid solid_part(vtkDataSet& mesh);

struct SamplingLattice {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< Centre of the first voxel.
  Eigen::Vector3d voxel = Eigen::Vector3d::Zero();   ///< Edges.
  Eigen::Vector3i size = Eigen::Vector3i::Zero();

  Eigen::Vector3d position(const Eigen::Vector3i& index) const {
    return origin + voxel.cwiseProduct(index.cast<double>());
  }
};

/// The lattice of the next level: half of the voxels' edges; every voxel is also one of this.
SamplingLattice finer(const SamplingLattice& lattice);

/// Whether cells have at least two sizes, which differ by powers of two: those of adaptive refinement.
bool is_adaptive(const Solid& solid);

constexpr double across_thickness = 4;  ///< Voxels across a thin body, wherever its faces are.

/// Whether a body is a plate or a shell: much thinner than its box, whose faces are not its own.
bool is_thin(const SamplingSettings& settings, const Eigen::AlignedBox3d& box);

/// What is sampled: the bounds that the user gives, else those of the mesh; of a slab, its whole thickness.
Eigen::AlignedBox3d sampled_box(const Solid& solid, const SamplingSettings& settings);

/// @throw std::invalid_argument as sample_mesh.
SamplingLattice sampling_lattice(vtkDataSet& mesh, const Solid& solid, const SamplingSettings& settings);

/// What blocks are filled from.
struct MeshSource {
  vtkDataSet& mesh;
  const double* point_tensors;  ///< Nine for each point; null: a cell has its tensor everywhere.
  const double* cell_tensors;   ///< Nine for each cell; may be null. Cells whose tensor is not finite are left out.
  const Solid& solid;
  const SamplingLattice& lattice;
  const int* layers;  ///< Of each cell (layer_array); null if no layers overlap.
  double tolerance;   ///< Distance from a cell below which a voxel's centre is in it.
};

/// Those of the blocks that may have active voxels, as sample_mesh (mesh_sampling.h) describes them, ordered by origin.
/// @param overlaid  Becomes the number of voxels that are in several layers.
TensorBlocks mesh_blocks(const MeshSource& source, const BlockPlaces& places, const Progress& progress,
                         std::size_t& overlaid);

}  // namespace tensorray
