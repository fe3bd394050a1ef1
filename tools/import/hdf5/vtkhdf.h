#pragma once
/// @file tools/import/hdf5/vtkhdf.h
/// Reads VTKHDF (.vtkhdf, .hdf): images and unstructured grids of the format's versions 1 and 2, with steps of time.
/// Debian 12's VTK reads version 1 alone, and no steps. Private to the importer.
/// The format: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html#vtkhdf-file-format

#include <filesystem>

class vtkDataObject;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// The number of steps of time; 1 if the file has none.
int vtkhdf_steps(const std::filesystem::path& path);

/// All parts at a step, from 0 on. @throw std::runtime_error, one line that names the file and the fix.
vtkSmartPointer<vtkDataObject> read_vtkhdf(const std::filesystem::path& path, int step);

}  // namespace tensorray
