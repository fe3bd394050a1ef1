#pragma once
/// The gradients of a vector that a mesh has at its cells.

#include <vtkSmartPointer.h>

class vtkDataArray;
class vtkDataSet;
class vtkDoubleArray;

namespace tensorray {

/// ∂v_i/∂x_j as component 3 i + j; NaN at cells that are not used, and at points that no used cell has.
struct CellGradients {
  vtkSmartPointer<vtkDoubleArray> of_cells, of_points;
};

/// The value of a cell is that at its centroid. Gradients are fitted by least squares, weighted by the inverse square
/// of the distance, to the differences from the cells across the faces (also where several faces meet one: hanging
/// nodes, or blocks that do not match), and from walls (cell_graph.h). Where these do not determine the gradient, all
/// cells with a common point are used. Then the gradient's own gradient, fitted alike, corrects the differences for
/// curvature, and extends the gradient linearly to the cell's points, which have the mean of what their cells say.
///
/// Exact for linear vectors everywhere. For smooth ones, also at the border, of second order on grids of hexahedra, and
/// of order 1.5 with bent tetrahedra. Along an axis with one cell, the derivative is zero. Cells are used that MeshCell
/// loads and whose vector is finite.
/// Threads: uses all; the result does not depend on their number.
CellGradients cell_gradients(vtkDataSet& mesh, vtkDataArray& vectors);

}  // namespace tensorray
