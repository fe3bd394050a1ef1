#pragma once
/// Which cells of a mesh are beside each other, and what a solver prescribes for a vector at the mesh's border.

#include <string>
#include <vector>

#include "tools/import/meshes/mesh_faces.h"

class vtkDoubleArray;

namespace tensorray {

/// What a solver prescribes for a vector at a face of the border.
struct Wall {
  enum class Kind { value, zero_gradient, slip };  ///< Slip: no flow through it, no gradient of the flow along it.

  Eigen::Vector3d centre, normal;  ///< As face_measure; the normal has unit length and points out of the mesh.
  Kind kind = Kind::value;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
};

/// Keeps the walls of the array of cells called `array` with the mesh, as field data.
void add_walls(vtkDataSet& mesh, const std::string& array, const std::vector<Wall>& walls);

struct CellGraph {
  std::vector<Eigen::Vector3d> centres;            ///< The centroids of the cells.
  std::vector<char> used;                          ///< Whether MeshCell loads a cell and its vector is finite.
  std::vector<std::vector<vtkIdType>> neighbours;  ///< Across faces, ascending.
  std::vector<std::vector<Wall>> walls;            ///< Of the cells.
  MeshPoints points;
  std::vector<std::vector<vtkIdType>> cells_at;  ///< The used cells that have a point, of those that represent others.
};

/// Neighbours have a face with the same corners, or faces that lie on each other: at hanging nodes, and where blocks
/// meet whose points do not match. Cells with a wall between them are none.
/// @param vectors  Of the cells. Its name is that of add_walls. Threads: uses all; the result does not depend on them.
CellGraph cell_graph(vtkDataSet& mesh, vtkDoubleArray& vectors);

/// The neighbours of a cell, and all cells with a point of it, ascending.
std::vector<vtkIdType> cells_around(vtkDataSet& mesh, const CellGraph& graph, vtkIdType id);

}  // namespace tensorray
