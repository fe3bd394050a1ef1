#pragma once
/// @file tools/import/cases/openfoam_fields.h
/// Corrects what VTK's reader of OpenFOAM makes of fields.

#include <filesystem>

class vtkDataSet;

namespace tensorray {

/// Gives symmetric tensors that are `uniform` in their files VTK's order. OpenFOAM writes xx xy xz yy yz zz; VTK
/// changes lists to its own order, xx yy zz xy yz xz, but not what is uniform. Fields whose values are not in the file
/// itself (macros, #include) are taken as uniform if they are the same in all cells. Arrays whose components have names
/// are left alone.
/// @param time  The folder of the time that was read.
void correct_uniform_tensors(vtkDataSet& data, const std::filesystem::path& time);

}  // namespace tensorray
