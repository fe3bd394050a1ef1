#pragma once
/// @file tools/import/cases/plot3d.h
/// Reads PLOT3D files as VTK data sets.

#include <filesystem>

class vtkDataSet;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// Reads PLOT3D: a grid file and its q file (single-block, or multi-block with one block; with or without iblank; raw
/// or with Fortran record marks; either byte order; float or double; two-dimensional files are an error). The result
/// is a curvilinear grid with the point arrays density, momentum, energy and velocity = momentum / density. Blanked
/// points (iblank 0) are ghost points. Bytes after the last number are ignored.
vtkSmartPointer<vtkDataSet> read_plot3d(const std::filesystem::path& grid, const std::filesystem::path& q);

}  // namespace tensorray
