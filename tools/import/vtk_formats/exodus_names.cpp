#include "tools/import/vtk_formats/exodus_names.h"

#include <array>
#include <string>
#include <vector>

#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <vtkExodusIIReader.h>
#include <vtk_exodusII.h>

namespace tensorray {
namespace {

/// The variables of a kind, in the file's order; none if they cannot be read.
std::vector<std::string> variable_names(const std::filesystem::path& path, ex_entity_type kind) {
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

}  // namespace

void name_components(vtkDataSet& data, vtkExodusIIReader& reader, const std::filesystem::path& path) {
  for (const bool of_cells : {false, true}) {
    const auto kind = of_cells ? vtkExodusIIReader::ELEM_BLOCK : vtkExodusIIReader::NODAL;
    const std::vector<std::string> names = variable_names(path, of_cells ? EX_ELEM_BLOCK : EX_NODAL);
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
