#pragma once
/// @file tools/import/cases/plot3d.h
/// Reads PLOT3D files as VTK data sets.

#include <filesystem>

class vtkDataSet;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// Reads PLOT3D: a grid file and its q file, both in one form (one block, with or without the number of blocks and
/// iblank; raw or with Fortran record marks; either byte order; float or double). The result is a curvilinear grid with
/// the point arrays density, momentum, energy and velocity = momentum / density, which is NaN where the density is 0.
/// Blanked points (iblank 0) are ghost points.
/// @throw std::runtime_error naming the file. VTK's reader may end the process: call this in a child process.
vtkSmartPointer<vtkDataSet> read_plot3d(const std::filesystem::path& grid, const std::filesystem::path& q);

}  // namespace tensorray
