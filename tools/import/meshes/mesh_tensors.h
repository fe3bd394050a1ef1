#pragma once
/// Makes tensors at the points of a mesh from the arrays that solvers write.

#include <functional>
#include <optional>
#include <string>

#include "tools/import/lattices/tensor_order.h"
#include "volumes/tensors/finite_differences.h"

class vtkDataArray;
class vtkDataSet;
class vtkDataSetAttributes;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// How an array becomes tensors.
enum class Take {
  tensor,          ///< The array's components are the tensor.
  gradient,        ///< T(i, j) = ∂v_i/∂x_j of a vector v.
  strain,          ///< The symmetric part of the gradient of a displacement.
  viscous_stress,  ///< viscous_stress() of the gradient of a velocity.
};

/// The tensor of the gradient G of a vector.
inline Eigen::Matrix3d tensor_of_gradient(Take take, const Eigen::Matrix3d& G) {
  return take == Take::viscous_stress ? viscous_stress(G) : take == Take::strain ? (G + G.transpose()) / 2 : G;
}

/// The option with which users choose the array, for messages.
const char* flag_of(Take take);

/// What tensors at cells are made of: an interpolation of their averages at points, or each cell's own everywhere in
/// it.
enum class CellValues { linear, constant };

/// The chosen array of a data set.
struct ArrayChoice {
  std::string name;
  bool of_cells = false;
  bool is_at_both = false;  ///< There is one at points and one at cells.
};

/// The arrays at the cells or points of a mesh.
vtkDataSetAttributes& attributes_of(vtkDataSet& mesh, bool of_cells);

/// The name of the array that with_tensors makes.
constexpr const char* tensor_array = "tensor";

/// Cells may have a vtkIntArray of this name: which of several layers, of which each overlaps others, they are in.
constexpr const char* layer_array = "tensorray:layer";

/// Calls `visit(array, of_cells)` for the named numeric arrays, first those of points; not for those of this program.
void for_each_array(vtkDataSet& mesh, const std::function<void(vtkDataArray&, bool)>& visit);

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

/// Whether `names` is a list of arrays, with commas between the names. An array whose own name has commas is no list.
bool is_array_list(vtkDataSet& mesh, const std::string& names);

/// Joins the components of tensors and vectors that are arrays of their own, as many solvers write them, listed in
/// `names`, to an array called "tensor", or "vector" of which a tensor is derived, and removes
/// the arrays that are listed from `mesh`. A tensor has six or nine components, or three vectors as rows; one of the
/// plane of x and y has three or four (xx, yy, xy, and perhaps zz, as the last two letters of their names tell). A
/// vector has three components; in a flat mesh across z also two. Each is a scalar array, NAME:COMPONENT of another
/// array (by the component's name, or its number from 0 on), or a component with that name, as VTK joins scalars of
/// ExodusII. Names may have commas. Spaces around a name do not count. A name may occur twice. All are at points, or
/// else all are at cells. The components of the new array have the names of the old ones, of which with_tensors finds
/// their order; they are sorted if that order has no name (tensor_order.h).
/// @param is_flat  The mesh is flat across z, or was before it became a slab.
/// @throw std::invalid_argument that names the array and lists those that there are.
ArrayChoice join_arrays(vtkDataSet& mesh, const std::string& names, Take take = Take::tensor, bool is_flat = false);

/// The points and cells of a mesh with one point array `tensor_array`: a vtkDoubleArray of nine components, row by
/// row. The tensors are the array's components (six, nine or more; of more than nine the first six are the tensor,
/// and the others are derived from it), or derivatives that are computed on the mesh itself, before any resampling.
/// Tensors of cells are averaged to points, over the cells that MeshCell uses and whose values are finite. Derivatives
/// of vectors of cells are those of cell_gradients.h. The result is NaN at points whose tensor is not finite, and at
/// hidden points. Derivatives do not use cells with points that are hidden or not finite. Where the array is one of
/// cells, the mesh also has a cell array `tensor_array`, and no point array if `cell_values` is constant.
/// @param order  Order of six components, and of more than nine. Not needed if the components' names tell it (XX, YY,
/// ...); then it must not contradict them.
/// @return a mesh that shares the geometry of the given one, and keeps its vtkGhostType.
/// @throw std::invalid_argument if the order is not known or contradicts the names; std::runtime_error if VTK cannot
/// differentiate on the mesh.
vtkSmartPointer<vtkDataSet> with_tensors(vtkDataSet& mesh, const ArrayChoice& array, Take take,
                                         const std::optional<TensorOrder>& order,
                                         CellValues cell_values = CellValues::linear);

/// The tensors that with_tensors makes, nine numbers each; null if there are none.
const double* made_tensors(vtkDataSetAttributes& attributes);

}  // namespace tensorray
