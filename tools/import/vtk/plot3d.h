#pragma once
/// @file tools/import/vtk/plot3d.h
/// PLOT3D files, as VTK data sets.

#include <filesystem>

class vtkDataSet;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// PLOT3D: a grid and its q file (single or multi-block with one block; with or without iblank; 2 or 3 dimensions is an
/// error; raw or with Fortran record marks; either byte order; float or double), as a curvilinear grid with point
/// arrays density, momentum, energy and velocity = momentum / density. Blanked points (iblank 0) are ghost points.
/// What is after the last number is passed over.
vtkSmartPointer<vtkDataSet> read_plot3d(const std::filesystem::path& grid, const std::filesystem::path& q);

}  // namespace tensorray
