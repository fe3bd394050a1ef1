#pragma once
/// @file tools/import/meshes/mesh_solid.h
/// The three-dimensional part of a mesh.

#include <vector>

#include <Eigen/Geometry>

class vtkDataSet;

namespace tensorray {

struct Solid {
  std::vector<Eigen::AlignedBox3d> boxes;  ///< Box of each cell of the mesh; empty for cells that are not used.
  std::vector<float> thickness;            ///< Of each used cell, world units: MeshCell::thickness.
  Eigen::AlignedBox3d bounds;              ///< Bounds of the points of the used cells.
  std::vector<bool> points;                ///< For each point of the mesh: whether a used cell has it.
};

/// Uses all threads. Afterwards several threads may load cells of `mesh`.
/// @throw std::invalid_argument if the mesh has no three-dimensional cells.
Solid solid_part(vtkDataSet& mesh);

}  // namespace tensorray
