#pragma once
/// @file tools/import/vtk_formats/symmetric_names.h
/// Names the components of arrays whose order the format defines, so that the user need not give it. Names that are
/// there stay. Private to the importer.

#include <filesystem>

class vtkDataSet;

namespace tensorray {

/// All arrays of six components.
void name_symmetric_components(vtkDataSet& data);

/// The array that the data set calls its tensors. VTK's symmetric tensors are xx yy zz xy yz xz.
void name_active_tensors(vtkDataSet& data);

/// The arrays that a legacy file calls TENSORS6. VTK keeps this of one of them only.
void name_tensors6(vtkDataSet& data, const std::filesystem::path& path);

}  // namespace tensorray
