#pragma once
/// @file tools/import/vtk_formats/array_names.h
/// Names the components of arrays, where the format or the file tells them, so that the user need not give their order.
/// Names that are there stay.

#include <filesystem>
#include <string>
#include <vector>

class vtkDataSet;
class vtkExodusIIReader;

namespace tensorray {

/// All arrays of six components, which VTK has in its order of symmetric tensors, xx yy zz xy yz xz.
void name_symmetric_components(vtkDataSet& data);

/// The array that the data set calls its tensors.
void name_active_tensors(vtkDataSet& data);

/// The arrays that a legacy file calls TENSORS6. VTK keeps this of one of them only.
void name_tensors6(vtkDataSet& data, const std::filesystem::path& path);

/// The variables of an ExodusII file, of nodes or of elements, in its order; none if they cannot be read.
std::vector<std::string> exodus_variables(const std::filesystem::path& path, bool of_cells);

/// The arrays that VTK's reader of ExodusII makes of several variables (stress_xx, stress_xy, stress_xz become a vector
/// stress_x): as these are called in the file. @param data  What the reader has read from `path`.
void name_components(vtkDataSet& data, vtkExodusIIReader& reader, const std::filesystem::path& path);

}  // namespace tensorray
