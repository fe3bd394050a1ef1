#pragma once
/// @file tools/import/vtk/vtk_geometry.h
/// Checks whether geometry that VTK has read can be used.

#include <filesystem>

class vtkDataSet;

namespace tensorray {

/// VTK accepts any geometry that a file holds, and may then read beyond its arrays or never end.
/// @throw std::runtime_error naming `path`: coordinates, an origin or a spacing not finite or beyond 1e30; fewer
/// points or coordinates than a grid's dimensions announce; cells of an unstructured grid that refer to missing
/// points, or that have fewer points than their type needs.
void check_geometry(vtkDataSet& data, const std::filesystem::path& path);

}  // namespace tensorray
