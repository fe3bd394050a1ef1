#pragma once
/// @file tools/import/vtk_formats/exodus_names.h
/// The names of the variables of ExodusII files. Private to the importer.

#include <filesystem>

class vtkDataSet;
class vtkExodusIIReader;

namespace tensorray {

/// Names the components of the arrays that VTK's reader makes of several variables (stress_xx, stress_xy, stress_xz
/// become a vector stress_x): as these are called in the file. @param data  What the reader has read from `path`.
void name_components(vtkDataSet& data, vtkExodusIIReader& reader, const std::filesystem::path& path);

}  // namespace tensorray
