#pragma once
/// Meshes in a plane, as results of two-dimensional solvers: they become slabs.

#include <optional>

class vtkDataSet;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// A mesh of cells with an area, in a plane across an axis.
struct FlatMesh {
  int axis = 2;  ///< 0 to 2: the axis across the plane.
  /// A typical edge of its cells: the square root of their median area; larger if more than two million such squares
  /// would fill the mesh's box.
  double edge = 0;
};

/// What is known of a mesh without three-dimensional cells; nothing if it has such cells, or none with an area.
/// @throw std::invalid_argument if its cells are a surface in space, or in a plane that is not across an axis.
std::optional<FlatMesh> flat_mesh(vtkDataSet& mesh);

/// The mesh, `thickness` thick and with the same values on both faces: triangles become wedges, quadrilaterals
/// hexahedra, and other cells are divided into triangles between their points. Vectors of two components across z get a
/// third one, zero. @param thickness  > 0.
vtkSmartPointer<vtkDataSet> slab_of(vtkDataSet& mesh, const FlatMesh& flat, double thickness);

/// Gives vectors of two components a third one, zero.
void pad_vectors(vtkDataSet& mesh);

}  // namespace tensorray
