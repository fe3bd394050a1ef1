#pragma once
/// @file tools/import/sampling/sampling_lattice.h
/// The lattice of voxels at which a mesh is sampled.

#include <Eigen/Geometry>

#include "tools/import/meshes/mesh_solid.h"
#include "tools/import/sampling/mesh_sampling.h"

namespace tensorray {

struct SamplingLattice {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< Centre of the first voxel.
  Eigen::Vector3d voxel = Eigen::Vector3d::Zero();   ///< Edges.
  Eigen::Vector3i size = Eigen::Vector3i::Zero();

  Eigen::Vector3d position(const Eigen::Vector3i& index) const {
    return origin + voxel.cwiseProduct(index.cast<double>());
  }
};

/// What is sampled: the bounds that the user gives, else those of the mesh; of a slab, its whole thickness.
Eigen::AlignedBox3d sampled_box(const Solid& solid, const SamplingSettings& settings);

/// @throw std::invalid_argument as sample_mesh.
SamplingLattice sampling_lattice(vtkDataSet& mesh, const Solid& solid, const SamplingSettings& settings);

}  // namespace tensorray
