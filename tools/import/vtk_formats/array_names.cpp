#include "tools/import/vtk_formats/array_names.h"

#include <array>
#include <cctype>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <vtkExodusIIReader.h>
#include <vtk_exodusII.h>

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

std::vector<std::string> exodus_variables(const std::filesystem::path& path, bool of_cells) {
  const ex_entity_type kind = of_cells ? EX_ELEM_BLOCK : EX_NODAL;
  int word = sizeof(double), stored = 0;
  float version = 0;
  const int file = ex_open(path.c_str(), EX_READ, &word, &stored, &version);
  if (file < 0) return {};
  constexpr int longest = 256;
  ex_set_max_name_length(file, longest);
  int count = 0;
  if (ex_get_variable_param(file, kind, &count) < 0) count = 0;
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) {
    std::array<char, longest + 1> name{};
    ex_get_variable_name(file, kind, i + 1, name.data());
    names.emplace_back(name.data());
  }
  ex_close(file);
  return names;
}

void name_components(vtkDataSet& data, vtkExodusIIReader& reader, const std::filesystem::path& path) {
  for (const bool of_cells : {false, true}) {
    const auto kind = of_cells ? vtkExodusIIReader::ELEM_BLOCK : vtkExodusIIReader::NODAL;
    const std::vector<std::string> names = exodus_variables(path, of_cells);
    vtkDataSetAttributes& attributes = *data.GetAttributes(of_cells ? vtkDataObject::CELL : vtkDataObject::POINT);
    std::size_t next = 0;  // VTK joins variables that follow each other.
    for (int i = 0; i < reader.GetNumberOfObjectArrays(kind); ++i) {
      const auto components = static_cast<std::size_t>(reader.GetNumberOfObjectArrayComponents(kind, i));
      vtkDataArray* const array = attributes.GetArray(reader.GetObjectArrayName(kind, i));
      const bool fits = next + components <= names.size();
      if (array && components > 1 && fits && array->GetNumberOfComponents() == static_cast<int>(components))
        for (std::size_t k = 0; k < components; ++k)
          array->SetComponentName(static_cast<vtkIdType>(k), names[next + k].c_str());
      next += components;
    }
  }
}

}  // namespace tensorray
