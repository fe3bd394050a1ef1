#pragma once
/// @file tools/import/surfaces/mesh_faces.h
/// The faces of a mesh's cells, and those on its outside.

#include <cstddef>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "tools/import/meshes/mesh_cell.h"

namespace tensorray {

/// The points of a mesh, and for each point the one that represents all points at the same position.
struct MeshPoints {
  std::vector<Eigen::Vector3d> positions;
  std::vector<vtkIdType> same;

  const Eigen::Vector3d& operator[](vtkIdType id) const { return positions[static_cast<std::size_t>(id)]; }
  vtkIdType representative(vtkIdType id) const { return same[static_cast<std::size_t>(id)]; }
};

MeshPoints points_of(vtkDataSet& mesh);

/// A face of a cell that has an area.
struct CellFace {
  vtkIdType cell = 0;
  int index = 0;  ///< Among the faces that VTK lists of the cell; of a convex point set, among MeshCell::faces.
  /// Representatives of its corners, counter-clockwise as seen from outside the cell. Equal neighbours are one.
  std::vector<vtkIdType> corners;
  bool reversed = false;  ///< Whether VTK lists the corners the other way round.
};

/// Whether a cell that is loaded counts. Several threads call it.
using IsUsed = std::function<bool(const MeshCell& cell, vtkIdType id)>;

/// The faces of the used cells that no other one has on its other side, by cell and index. Each cell's faces look out
/// of it, also if its points are listed inside out, so that the faces together bound the cells: each edge of a face has
/// its opposite in another one. Curved faces are known by their corners.
/// Uses all threads; the result does not depend on their number.
std::vector<CellFace> outer_faces(vtkDataSet& mesh, const MeshPoints& points, const IsUsed& is_used);

/// Half the sum of cross products around a face: its normal, as long as its area.
Eigen::Vector3d area_of(const CellFace& face, const MeshPoints& points);

/// Removes faces of cells whose diagonals differ: two triangles against a quadrilateral of the same four points, or
/// against the two triangles with the other diagonal. What is left bounds the cells, but for the space between the two.
/// @return the number of faces that were removed.
std::size_t remove_crossed_faces(std::vector<CellFace>& faces, const MeshPoints& points);

}  // namespace tensorray
