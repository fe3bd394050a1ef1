#pragma once
/// @file tools/import/vtk/vtk_source.h
/// Meshes as VTK data sets, from the formats that solvers write.

#include <filesystem>

class vtkDataSet;
template <class T>
class vtkSmartPointer;

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
/// check_geometry (vtk_geometry.h).
/// @throw std::runtime_error, one line with the file and the mend; what VTK would print is part of it.
vtkSmartPointer<vtkDataSet> read_vtk_source(const std::filesystem::path& path);

}  // namespace tensorray
