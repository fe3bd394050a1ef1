#pragma once
/// @file tools/import/vtk/openfoam_fields.h
/// Corrects what VTK's reader of OpenFOAM makes of fields. Private to the importer.

#include <filesystem>

class vtkDataSet;

namespace tensorray {

/// Sets the symmetric tensors that are `uniform` in their files. OpenFOAM writes them as xx xy xz yy yz zz; VTK changes
/// lists of them to its own order, xx yy zz xy yz xz, but not those that are uniform.
/// @param time  The folder of the time that was read.
void correct_uniform_tensors(vtkDataSet& data, const std::filesystem::path& time);

}  // namespace tensorray
