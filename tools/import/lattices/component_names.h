#pragma once
/// @file tools/import/lattices/component_names.h
/// What the names of an array's components tell of their order. Private to the importer.

#include <optional>
#include <string>

#include "tools/import/lattices/tensor_order.h"

class vtkDataArray;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// The name of a component; empty if it has none.
std::string component_name(vtkDataArray& array, int component);

/// The entry of a tensor, 3 · row + column, that the last two letters of a name tell, as ParaView, converters of
/// CalculiX and others write them: XX, S_YY, xy, S13, ...; −1 if they tell none.
int entry_named(const std::string& name);

/// The order that the names of the first four or six components tell. The two indices of each may be swapped.
std::optional<TensorOrder> order_of_names(vtkDataArray& array);

/// If the names tell all entries of a tensor: the tensor in VTK's order, of nine components row by row. Else the array
/// itself.
vtkSmartPointer<vtkDataArray> sorted_by_names(vtkDataArray& array);

/// If the names tell all entries of a tensor, but in an order that has no name: the tensor sorted by them. Else the
/// array itself.
vtkSmartPointer<vtkDataArray> in_known_order(vtkDataArray& array);

}  // namespace tensorray
