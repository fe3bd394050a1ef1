#pragma once
/// @file tools/import/meshes/mesh_tensors.h
/// Makes tensors at the points of a mesh from the arrays that solvers write.

#include <optional>
#include <string>

#include "tools/import/lattices/tensor_order.h"

class vtkDataArray;
class vtkDataSet;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// How an array becomes tensors.
enum class Take {
  tensor,    ///< The array's components are the tensor.
  gradient,  ///< T(i, j) = ∂v_i/∂x_j of a vector v.
  strain,    ///< The symmetric part of the gradient of a displacement.
};

/// What tensors at cells are made of: an interpolation of their averages at points, or each cell's own everywhere in
/// it.
enum class CellValues { linear, constant };

/// The chosen array of a data set.
struct ArrayChoice {
  std::string name;
  bool of_cells = false;
};

/// The name of the array that with_tensors makes.
constexpr const char* tensor_array = "tensor";

/// The arrays of a mesh in words, for messages: "there are: velocity (3 components, points), ...".
std::string list_of_arrays(vtkDataSet& mesh);

/// The order of an array of six, nine or more components, by their names or as `given`.
/// @throw std::invalid_argument if it is not known, or if the names contradict `given`.
TensorOrder order_in(vtkDataArray& array, const std::optional<TensorOrder>& given);

/// Finds the array called `name`; if `name` is empty, the only array that suits `take` (6, 9, or at least 10
/// components; 3 for a gradient). If a point array and a cell array have the same name, the point array is chosen, or
/// that of cells if the cells' values are to be `constant`.
/// @throw std::invalid_argument that lists the arrays with their components and whether they are at points or cells.
ArrayChoice choose_array(vtkDataSet& mesh, const std::string& name, Take take,
                         CellValues cell_values = CellValues::linear);

/// The points and cells of a mesh with one point array `tensor_array`: a vtkDoubleArray of nine components, row by
/// row. The tensors are the array's components (six, nine or more; of more than nine the first six are the tensor,
/// and the others are derived from it), or derivatives that are computed on the mesh itself, before any resampling.
/// Cell arrays are first averaged to points, over the cells that MeshCell uses and whose values are finite. The result
/// is NaN at points whose tensor is not finite, and at hidden points. Derivatives do not use cells with points that are
/// hidden or not finite. Where the tensors themselves are an array of cells, the mesh also has it as a cell array
/// `tensor_array`, and no point array if `cell_values` is constant.
/// @param order  Order of six components, and of more than nine. Not needed if the components' names tell it (XX, YY,
/// ...); then it must not contradict them.
/// @return a mesh that shares the geometry of the given one, and keeps its vtkGhostType.
/// @throw std::invalid_argument if the order is not known or contradicts the names; std::runtime_error if VTK cannot
/// differentiate on the mesh.
vtkSmartPointer<vtkDataSet> with_tensors(vtkDataSet& mesh, const ArrayChoice& array, Take take,
                                         const std::optional<TensorOrder>& order,
                                         CellValues cell_values = CellValues::linear);

}  // namespace tensorray
