#pragma once
/// @file tools/import/meshes/component_arrays.h
/// Tensors whose components are scalar arrays of their own, as many solvers write them.

#include <string>

class vtkDataSet;

namespace tensorray {

struct ArrayChoice;

/// Whether `names` is a list of arrays, with commas between the names. An array whose own name has commas is no list.
bool is_array_list(vtkDataSet& mesh, const std::string& names);

/// Joins the six or nine scalar arrays listed in `names` to an array called "tensor", and removes them from `mesh`.
/// Spaces around a name do not count. A name may occur twice. All arrays are at points, or else all are at cells. The
/// components of the new array have the names of the arrays, of which with_tensors (mesh_tensors.h) finds their order.
/// @throw std::invalid_argument that names the array and lists those that there are.
ArrayChoice join_arrays(vtkDataSet& mesh, const std::string& names);

}  // namespace tensorray
