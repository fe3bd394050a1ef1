#include "tools/import/vtk_formats/array_names.h"

#include <cctype>
#include <fstream>
#include <sstream>
#include <string>

#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>

#include "base/text/text.h"
#include "tools/import/lattices/tensor_order.h"

namespace tensorray {
namespace {

void name_six(vtkDataArray* array) {
  if (array && array->GetNumberOfComponents() == 6 && !array->HasAComponentName()) name_vtk_components(*array);
}

/// A name as legacy files write it: %20 is a space.
std::string decoded(const std::string& name) {
  std::string text;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool is_code = name[i] == '%' && i + 2 < name.size() &&
                         std::isxdigit(static_cast<unsigned char>(name[i + 1])) &&
                         std::isxdigit(static_cast<unsigned char>(name[i + 2]));
    text += is_code ? static_cast<char>(std::stoi(name.substr(i + 1, 2), nullptr, 16)) : name[i];
    if (is_code) i += 2;
  }
  return text;
}

}  // namespace

void name_symmetric_components(vtkDataSet& data) {
  for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL})
    for (int i = 0; i < data.GetAttributes(type)->GetNumberOfArrays(); ++i)
      name_six(data.GetAttributes(type)->GetArray(i));
}

void name_active_tensors(vtkDataSet& data) {
  for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL}) name_six(data.GetAttributes(type)->GetTensors());
}

void name_tensors6(vtkDataSet& data, const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  for (int i = 0; i < 2; ++i) std::getline(file, line);  // The version, and a title that may be any text.
  while (std::getline(file, line)) {
    const std::size_t start = lower_case(line).rfind("tensors6 ");  // Binary numbers may stand before it.
    if (start == std::string::npos) continue;
    std::istringstream words(line.substr(start));
    std::string keyword, name;
    words >> keyword >> name;
    for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL})
      name_six(data.GetAttributes(type)->GetArray(decoded(name).c_str()));
  }
}

}  // namespace tensorray
