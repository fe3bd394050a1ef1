#pragma once
/// @file tools/import/vtk/image_lattice.h
/// From VTK's images to lattices.

#include "tools/import/lattices/lattice.h"

class vtkDataArray;
class vtkImageData;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// The voxels of an image and one of its point arrays, or cell arrays (then voxels are the cells' centres). The array's
/// memory is given back slice by slice where nobody else holds it: hand both over with std::move. Hidden voxels are
/// NaN. The components' axes are the world's, whatever the image's direction matrix, as VTK has it.
/// @throw std::runtime_error (without a file's name, which is the caller's) if the array does not fit the image, or the
/// image's spacing or direction cannot be inverted; an axis of one voxel may have no spacing.
Lattice lattice_of(vtkSmartPointer<vtkImageData> image, vtkSmartPointer<vtkDataArray> values, bool of_cells);

}  // namespace tensorray
