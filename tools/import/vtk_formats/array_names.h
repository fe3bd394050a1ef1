#pragma once
/// Names the components of arrays, where the format or the file tells them, so that the user need not give their order.
/// Names that are there stay.

#include <filesystem>

class vtkDataSet;

namespace tensorray {

/// All arrays of six components, which VTK has in its order of symmetric tensors, xx yy zz xy yz xz.
void name_symmetric_components(vtkDataSet& data);

/// The array that the data set calls its tensors.
void name_active_tensors(vtkDataSet& data);

/// The arrays that a legacy file calls TENSORS6. VTK keeps this of one of them only.
void name_tensors6(vtkDataSet& data, const std::filesystem::path& path);

}  // namespace tensorray
