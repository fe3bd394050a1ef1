#pragma once
/// @file tools/import/meshes/mesh_tensors.h
/// Tensors at the points of a mesh, of the arrays that solvers write.

#include <optional>
#include <string>

#include "tools/import/lattices/tensor_order.h"

class vtkDataSet;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// What is made of an array.
enum class Take {
  tensor,    ///< The array's components are the tensor.
  gradient,  ///< T(i, j) = ∂v_i/∂x_j of a vector v.
  strain,    ///< The symmetric part of the gradient of a displacement.
};

/// An array of a data set.
struct ArrayChoice {
  std::string name;
  bool of_cells = false;
};

/// The name of the array that with_tensors makes.
constexpr const char* tensor_array = "tensor";

/// The array called `name`; if empty, the only one that suits `take` (6, 9 or 10 and more components; 3 for a
/// gradient). Point arrays come before cell arrays of the same name.
/// @throw std::invalid_argument listing what arrays there are, with components and where they are.
ArrayChoice choose_array(vtkDataSet& mesh, const std::string& name, Take take);

/// The points and cells of a mesh with one point array `tensor_array`: a vtkDoubleArray of nine components, row by row.
/// It is made of six, nine or more components (of more than nine the first six are the tensor, the others derived from
/// it), or by differentiating on the mesh itself, before any resampling. Cell arrays are averaged to points first, over
/// the three-dimensional cells that are not hidden. Points whose tensor is not finite, and hidden ones (blanked:
/// vtkGhostType with another bit than that of a duplicate), get NaN; a derivative never looks at hidden points of a
/// curvilinear grid.
/// @param order  Of six and more than nine components. Not needed where the names of the components say it (XX, YY,
/// ...), and then not to contradict them.
/// @return a mesh that shares the geometry, and keeps the vtkGhostType, of the given one.
/// @throw std::invalid_argument if no order is known or it is another than the names', or std::runtime_error if VTK
/// cannot differentiate on the mesh.
vtkSmartPointer<vtkDataSet> with_tensors(vtkDataSet& mesh, const ArrayChoice& array, Take take,
                                         const std::optional<TensorOrder>& order);

}  // namespace tensorray
