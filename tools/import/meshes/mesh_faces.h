#pragma once
/// The faces of a mesh's cells, and those on its outside.

#include <cstdint>
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

/// A face without its corners.
struct CellSide {
  std::uint64_t key;  ///< Of the set of its corners.
  vtkIdType cell;
  int index;
  bool turn;  ///< Differs for two faces with the same corners if they look in opposite directions.

  bool operator<(const CellSide& other) const;
};

/// Is given a cell that is loaded and its faces, and removes those that do not count. Several threads call it.
using ChooseFaces = std::function<void(const MeshCell& cell, vtkIdType id, std::vector<CellFace>& faces)>;

/// The chosen faces of all cells, sorted: those with the same corners follow each other. Each cell's faces look out
/// of it, also if its points are listed inside out. Curved faces are known by their corners. Uses all threads; the
/// result does not depend on their number. So do the functions below.
std::vector<CellSide> sides_of(vtkDataSet& mesh, const MeshPoints& points, const ChooseFaces& choose);

/// The faces with their corners, in the same order.
std::vector<CellFace> faces_at(vtkDataSet& mesh, const MeshPoints& points, const std::vector<CellSide>& sides);

/// The chosen faces that no other one has on its other side, by cell and index: together they bound the cells, and
/// each edge of a face has its opposite in another one.
std::vector<CellFace> outer_faces(vtkDataSet& mesh, const MeshPoints& points, const ChooseFaces& choose);

/// The centre and the area, along the normal, of a polygon that need not be flat: the sums of the triangles between
/// its edges and the mean of its corners, as solvers of finite volumes take them.
struct FaceMeasure {
  Eigen::Vector3d centre, area;
};
FaceMeasure face_measure(const Eigen::Matrix3Xd& corners);
Eigen::Matrix3Xd corners_of(const CellFace& face, const MeshPoints& points);

/// Removes faces of cells whose diagonals differ: two triangles against a quadrilateral of the same four points, or
/// against the two triangles with the other diagonal. What is left bounds the cells, but for the space between the
/// two.
/// @return the number of faces that were removed.
std::size_t remove_crossed_faces(std::vector<CellFace>& faces, const MeshPoints& points);

}  // namespace tensorray
