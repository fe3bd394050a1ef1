#pragma once
/// @file tools/import/lattices/component_names.h
/// What the names of an array's components tell of their order.

#include <optional>
#include <string>

#include "tools/import/lattices/tensor_order.h"

class vtkDataArray;
template <class T>
class vtkSmartPointer;

namespace tensorray {

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
