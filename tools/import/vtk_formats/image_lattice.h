#pragma once
/// Converts VTK's images to lattices.

#include "tools/import/lattices/lattice.h"

class vtkDataArray;
class vtkImageData;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// The voxels of an image with one of its point arrays, or with one of its cell arrays (then voxels are at the
/// centres of cells). The array's memory is freed slice by slice if nobody else holds it: pass both arguments with
/// std::move. Hidden voxels are NaN. As in VTK, the components are in world axes, whatever the image's direction
/// matrix is.
/// @throw std::runtime_error (without the file's name, which the caller adds) if the array does not fit the image, or
/// if the image's spacing or direction cannot be inverted. An axis with one voxel may have no spacing.
Lattice lattice_of(vtkSmartPointer<vtkImageData> image, vtkSmartPointer<vtkDataArray> values, bool of_cells);

}  // namespace tensorray
