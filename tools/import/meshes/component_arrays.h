#pragma once
/// @file tools/import/meshes/component_arrays.h
/// Tensors and vectors whose components are arrays of their own, as many solvers write them.

#include <string>

#include "tools/import/meshes/mesh_tensors.h"

class vtkDataSet;

namespace tensorray {

/// Whether `names` is a list of arrays, with commas between the names. An array whose own name has commas is no list.
bool is_array_list(vtkDataSet& mesh, const std::string& names);

/// Joins what is listed in `names` to an array called "tensor", or "vector" of which a tensor is derived, and removes
/// the arrays that are listed from `mesh`. A tensor has six or nine components, or three vectors as rows; one of the
/// plane of x and y has three or four (xx, yy, xy, and perhaps zz, as the last two letters of their names tell). A
/// vector has three components; in a flat mesh across z also two. Each is a scalar array, NAME:COMPONENT of another
/// array (by the component's name, or its number from 0 on), or a component with that name, as VTK joins scalars of
/// ExodusII. Spaces around a name do not count. A name may occur twice. All are at points, or else all are at cells.
/// The components of the new array have the names of the old ones, of which with_tensors (mesh_tensors.h) finds their
/// order; they are sorted if that order has no name (component_names.h).
/// @param is_flat  The mesh is flat across z, or was before it became a slab.
/// @throw std::invalid_argument that names the array and lists those that there are.
ArrayChoice join_arrays(vtkDataSet& mesh, const std::string& names, Take take = Take::tensor, bool is_flat = false);

}  // namespace tensorray
