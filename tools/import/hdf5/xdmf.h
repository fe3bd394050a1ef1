#pragma once
/// @file tools/import/hdf5/xdmf.h
/// Reads XDMF (.xdmf, .xmf), versions 2 and 3: images, rectilinear, structured and unstructured grids, with steps of
/// time, whose numbers are in the XML, in HDF5 files, or in binary files. Debian's VTK has no reader of it.

#include "tools/import/vtk/mesh_file.h"

namespace tensorray {

/// The grids of a step: one block each. Grids of the same mesh, as FEniCSx writes one for each function, are one block.
/// Values at faces, edges or of a whole grid, and of FEniCS's own kind (FiniteElementFunction) are left out.
/// @throw std::runtime_error, one line that names the file and the fix.
MeshFile open_xdmf(const std::filesystem::path& path);

}  // namespace tensorray
