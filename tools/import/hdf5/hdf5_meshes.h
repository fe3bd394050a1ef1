#pragma once
/// Meshes whose numbers are in HDF5 files. Of them Debian 12's VTK reads VTKHDF of version 1 alone, without steps.

#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {

/// Reads VTKHDF (.vtkhdf, .hdf): images and unstructured grids of the format's versions 1 and 2, with steps of time.
/// The format: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html#vtkhdf-file-format
/// @throw std::runtime_error, one line that names the file and the fix.
MeshFile open_vtkhdf(const std::filesystem::path& path);

/// Reads XDMF (.xdmf, .xmf), versions 2 and 3: images, rectilinear, structured and unstructured grids, with steps of
/// time, whose numbers are in the XML, in HDF5 files, or in binary files. The grids of a step are one block each; those
/// of the same mesh, as FEniCSx writes one for each function, are one block. Values at faces, edges or of a whole grid,
/// and of FEniCS's own kind (FiniteElementFunction) are left out.
/// @throw std::runtime_error, one line that names the file and the fix.
MeshFile open_xdmf(const std::filesystem::path& path);

}  // namespace tensorray
