#pragma once
/// The orders in which programs write the components of a tensor, and what the names of components tell of them.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

class vtkDataArray;
template <class T>
class vtkSmartPointer;

namespace tensorray {

enum class TensorOrder {
  vtk,             ///< Six: xx yy zz xy yz xz. VTK, ParaView, Ansys, CalculiX.
  fsl,             ///< Six: xx xy xz yy yz zz. FSL, NRRD. OpenFOAM's files also use it, but VTK converts them to `vtk`.
  mrtrix,          ///< Six: xx yy zz xy xz yz. MRtrix.
  voigt,           ///< Six: xx yy zz yz xz xy. Continuum mechanics.
  lower_triangle,  ///< Six: xx xy yy xz yz zz. NIfTI with the intent "symmetric matrix" (ITK, ANTs), dipy, AFNI.
  plane,           ///< Four, of a plane: xx yy zz xy; the others are zero. Ansys, Abaqus, CalculiX.
  two_by_two,      ///< Four, of a plane: xx xy yx yy; the others are zero.
  full,            ///< Nine: xx xy xz yx yy yz zx zy zz, row by row.
};

/// The orders that users can choose, with their names: "vtk", "fsl", "mrtrix", "voigt", "lower", "plane", "2x2".
const std::vector<std::pair<std::string, TensorOrder>>& tensor_orders();

/// The entry of a tensor, 3 · row + column, of each component.
const std::vector<int>& entries_of(TensorOrder order);

/// An entry, or the one across the diagonal, that is not below it.
inline int upper(int entry) { return entry / 3 > entry % 3 ? 3 * (entry % 3) + entry / 3 : entry; }

/// The order of an array of four, six, nine or more components.
/// @param said  What the file says of it. @param given  What the user says. @param what  The array, for messages.
/// @throw std::invalid_argument if neither says it, or if the user says it of an array whose order is known otherwise.
TensorOrder chosen_order(int components, const std::optional<TensorOrder>& said,
                         const std::optional<TensorOrder>& given, const std::string& what);

/// The tensor of as many components as the order has entries. Six components make a symmetric tensor.
Eigen::Matrix3d tensor_of(const double* components, TensorOrder order);

/// The name of a component; empty if it has none.
std::string component_name(vtkDataArray& array, int component);

/// Names the six components of a symmetric tensor in VTK's order: XX, YY, ZZ, XY, YZ, XZ.
void name_vtk_components(vtkDataArray& array);

/// The position among the entries of `order` (vtk or full) of the one that the last two letters of a name tell, as
/// ParaView, converters of CalculiX and others write them: XX, S_YY, xy, S13, ...; −1 if they tell none. Of a symmetric
/// tensor they may be swapped.
int named_position(const std::string& name, TensorOrder order);

/// The order that the names of the first four or six components tell.
std::optional<TensorOrder> order_of_names(vtkDataArray& array);

/// If the names tell all entries of a tensor: the tensor in VTK's order, of nine components row by row. Else the array
/// itself.
vtkSmartPointer<vtkDataArray> sorted_by_names(vtkDataArray& array);

/// If the names tell all entries of a tensor, but in an order that has no name: the tensor sorted by them. Else the
/// array itself.
vtkSmartPointer<vtkDataArray> in_known_order(vtkDataArray& array);

}  // namespace tensorray
