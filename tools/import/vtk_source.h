#pragma once
/// @file tools/import/vtk_source.h
/// Meshes as VTK data sets, from the formats that solvers write. Private to the importer: it includes VTK.

#include <filesystem>
#include <string>
#include <vector>

#include <vtkDataSet.h>
#include <vtkSmartPointer.h>

#include "tools/import/lattice.h"

class vtkDataArray;
class vtkImageData;

namespace tensorray {

/// Reads a data set; of several blocks or pieces, one unstructured grid of all with points merged where they meet.
///   .vtk (legacy)  .vti .vtr .vts .vtu  .pvti .pvtr .pvts .pvtu  .ex2 .exo .e .g (ExodusII: last time step)
///   .foam, controlDict or a folder with system/controlDict (OpenFOAM: last time step, internal mesh)
/// OpenFOAM has its fields at cells; VTK adds points with the mean of their cells under the same names. A symmTensor
/// (xx xy xz yy yz zz in OpenFOAM's files) comes in VTK's order, its components named XX YY ZZ XY YZ XZ. A
/// volTensorField comes as it is: of OpenFOAM's grad(U), which is ∂_i u_j, that is the transpose of this program's
/// gradients. Points of an ExodusII mesh are where they were meshed, not displaced. Images stay vtkImageData,
/// structured and rectilinear grids what they are, also if they were in pieces. Ghosts: see vtk_pieces.h. The kind is
/// found in the contents where they say it, so that a wrong ending is an error that names both. VTK's readers may end
/// the process, or never, on damaged files: call it where that is survivable. What it returns has passed
/// check_geometry.
/// @throw std::runtime_error, one line with the file and the mend; what VTK would print is part of it.
vtkSmartPointer<vtkDataSet> read_vtk_source(const std::filesystem::path& path);

/// VTK takes any geometry that a file holds, and then reads beyond its arrays, or never ends.
/// @throw std::runtime_error naming `path`: coordinates, an origin or a spacing not finite or beyond 1e30; fewer points
/// or coordinates than a grid's dimensions; cells of an unstructured grid with points that are not there, or with fewer
/// than their type needs.
void check_geometry(vtkDataSet& data, const std::filesystem::path& path);

/// PLOT3D: a grid and its q file (single or multi-block with one block; with or without iblank; 2 or 3 dimensions is an
/// error; raw or with Fortran record marks; either byte order; float or double), as a curvilinear grid with point
/// arrays density, momentum, energy and velocity = momentum / density. Blanked points (iblank 0) are ghost points.
/// What is after the last number is passed over.
vtkSmartPointer<vtkDataSet> read_plot3d(const std::filesystem::path& grid, const std::filesystem::path& q);

/// The voxels of an image and one of its point arrays, or cell arrays (then voxels are the cells' centres). The array's
/// memory is given back slice by slice where nobody else holds it: hand both over with std::move. Hidden voxels are
/// NaN. The components' axes are the world's, whatever the image's direction matrix, as VTK has it.
/// @throw std::runtime_error (without a file's name, which is the caller's) if the array does not fit the image, or the
/// image's spacing or direction cannot be inverted; an axis of one voxel may have no spacing.
Lattice lattice_of(vtkSmartPointer<vtkImageData> image, vtkSmartPointer<vtkDataArray> values, bool of_cells);

}  // namespace tensorray
