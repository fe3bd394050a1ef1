#pragma once
/// @file tools/import/vtk/vtk_geometry.h
/// Whether what VTK has read can be used.

#include <filesystem>

class vtkDataSet;

namespace tensorray {

/// VTK takes any geometry that a file holds, and then reads beyond its arrays, or never ends.
/// @throw std::runtime_error naming `path`: coordinates, an origin or a spacing not finite or beyond 1e30; fewer points
/// or coordinates than a grid's dimensions; cells of an unstructured grid with points that are not there, or with fewer
/// than their type needs.
void check_geometry(vtkDataSet& data, const std::filesystem::path& path);

}  // namespace tensorray
