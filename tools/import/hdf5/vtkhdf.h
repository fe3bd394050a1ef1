#pragma once
/// @file tools/import/hdf5/vtkhdf.h
/// Reads VTKHDF (.vtkhdf, .hdf): images and unstructured grids of the format's versions 1 and 2, with steps of time.
/// Debian 12's VTK reads version 1 alone, and no steps.
/// The format: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html#vtkhdf-file-format

#include "tools/import/vtk/mesh_file.h"

namespace tensorray {

/// All parts of a step. @throw std::runtime_error, one line that names the file and the fix.
MeshFile open_vtkhdf(const std::filesystem::path& path);

}  // namespace tensorray
