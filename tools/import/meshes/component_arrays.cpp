#include <algorithm>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>

#include "base/text/text.h"
#include "tools/import/lattices/tensor_order.h"
#include "tools/import/meshes/mesh_tensors.h"

namespace tensorray {
namespace {

using Names = std::vector<std::string>;

/// A component of an array; `component` is -1 for a vector as a whole.
struct Part {
  vtkDataArray* array = nullptr;
  int component = 0;
};

/// A component by its name or its number from 0 on; -2 if there is none.
int component_called(vtkDataArray& array, const std::string& name) {
  for (int i = 0; i < array.GetNumberOfComponents(); ++i)
    if (name == component_name(array, i) || name == std::to_string(i)) return i;
  return -2;
}

/// What `name` means: an array, NAME:COMPONENT, or a component whose name is its own.
std::optional<Part> part_called(vtkDataSetAttributes& data, const std::string& name) {
  if (name.empty()) return {};
  if (vtkDataArray* const array = data.GetArray(name.c_str()))
    return Part{array, array->GetNumberOfComponents() == 1 ? 0 : -1};
  const std::size_t colon = name.rfind(':');
  if (vtkDataArray* const array = colon == std::string::npos ? nullptr : data.GetArray(name.substr(0, colon).c_str())) {
    const int component = component_called(*array, name.substr(colon + 1));
    if (component >= 0) return Part{array, component};
  }
  for (int i = 0; i < data.GetNumberOfArrays(); ++i)
    if (vtkDataArray* const array = data.GetArray(i))
      for (int k = 0; k < array->GetNumberOfComponents(); ++k)
        if (array->GetNumberOfComponents() > 1 && component_name(*array, k) == name) return Part{array, k};
  return {};
}

/// The names in a list. What lies between several commas is one name where the mesh has it.
Names names_in(vtkDataSet& mesh, const std::string& list) {
  Names parts, names;
  std::istringstream stream(list + ",");  // getline drops an empty name at the end
  for (std::string name; std::getline(stream, name, ',');) parts.push_back(name);
  const auto is_known = [&](const std::string& name) {
    return part_called(*mesh.GetPointData(), name) || part_called(*mesh.GetCellData(), name);
  };
  for (std::size_t i = 0, next = 0; i < parts.size(); i = next) {
    std::string name = trimmed(parts[i]), longer = parts[i];
    next = i + 1;
    for (std::size_t k = i + 1; k < parts.size(); ++k)
      if (longer += "," + parts[k]; is_known(trimmed(longer))) name = trimmed(longer), next = k + 1;
    names.push_back(name);
  }
  return names;
}

/// The attributes, of points or else of cells, that have all that is listed.
vtkDataSetAttributes& attributes_with(vtkDataSet& mesh, const Names& names) {
  vtkDataSetAttributes &points = *mesh.GetPointData(), &cells = *mesh.GetCellData();
  for (vtkDataSetAttributes* const data : {&points, &cells})
    if (std::all_of(names.begin(), names.end(), [&](const auto& name) { return part_called(*data, name).has_value(); }))
      return *data;
  for (const std::string& name : names)
    if (!part_called(points, name) && !part_called(cells, name))
      throw std::invalid_argument(
          fmt::format("no array \"{}\" in the list, nor such a component; {}", name, list_of_arrays(mesh)));
  throw std::invalid_argument("some arrays of the list are at points, others at cells; " + list_of_arrays(mesh));
}

/// Whether the parts are the components of a tensor in the plane of x and y.
bool is_plane(const std::vector<Part>& parts, Take take) {
  return take == Take::tensor && (parts.size() == 3 || parts.size() == 4);
}

/// The components that make the new array, in its order: three vectors are the rows of a tensor.
std::vector<Part> parts_of(vtkDataSet& mesh, vtkDataSetAttributes& data, const Names& names, Take take, bool is_flat) {
  std::vector<Part> parts;
  for (const std::string& name : names) parts.push_back(*part_called(data, name));
  const auto is_vector = [](const Part& part) {
    return part.component < 0 && part.array->GetNumberOfComponents() == 3;
  };
  if (take == Take::tensor && names.size() == 3 && std::all_of(parts.begin(), parts.end(), is_vector)) {
    std::vector<Part> rows;
    for (const Part& part : parts)
      for (int i = 0; i < 3; ++i) rows.push_back({part.array, i});
    return rows;
  }
  for (std::size_t i = 0; i < parts.size(); ++i)
    if (parts[i].component < 0)
      throw std::invalid_argument(fmt::format(
          "array \"{}\" has {} components, and each array of a list is one component: give {}:COMPONENT; {}", names[i],
          parts[i].array->GetNumberOfComponents(), names[i], list_of_arrays(mesh)));
  const std::size_t count = parts.size();
  const bool fits =
      take == Take::tensor ? count == 6 || count == 9 || is_plane(parts, take) : count == 3 || (count == 2 && is_flat);
  if (fits) return parts;
  throw std::invalid_argument(
      fmt::format("{} lists {} arrays, and {}; {}", flag_of(take), names.size(),
                  take == Take::tensor ? "a tensor has 6 or 9 components, of a plane 3 or 4, or 3 vectors as rows"
                                       : "a vector has 3 components, in a flat mesh across z also 2",
                  list_of_arrays(mesh)));
}

/// An array for the components, of their type if they have the same.
vtkSmartPointer<vtkDataArray> new_array(const std::vector<Part>& parts, int components, Take take) {
  const int first = parts.front().array->GetDataType();
  const bool same =
      std::all_of(parts.begin(), parts.end(), [&](const Part& part) { return part.array->GetDataType() == first; });
  const auto array = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(same ? first : VTK_DOUBLE));
  array->SetName(take == Take::tensor ? tensor_array : "vector");
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(parts.front().array->GetNumberOfTuples());
  return array;
}

/// The name of a component by itself: of which the order of a tensor's components is found.
std::string name_of(const Part& part) {
  const std::string name = component_name(*part.array, part.component);
  return name.empty() && part.array->GetNumberOfComponents() == 1 ? part.array->GetName() : name;
}

/// The components in the order of the parts; a vector's third one is zero if it has two.
vtkSmartPointer<vtkDataArray> joined_in_order(const std::vector<Part>& parts, Take take) {
  const int count = static_cast<int>(parts.size());
  vtkSmartPointer<vtkDataArray> joined = new_array(parts, std::max(count, 3), take);
  joined->Fill(0);
  for (int i = 0; i < count; ++i) {
    const Part& part = parts[static_cast<std::size_t>(i)];
    joined->CopyComponent(i, part.array, part.component);
    joined->SetComponentName(i, name_of(part).c_str());
  }
  return joined;
}

/// The components xx, yy, xy, and perhaps zz, of a tensor in the plane of x and y, in VTK's order; the others are zero.
vtkSmartPointer<vtkDataArray> joined_of_plane(vtkDataSet& mesh, const std::vector<Part>& parts) {
  std::vector<int> positions;
  for (const Part& part : parts) positions.push_back(named_position(name_of(part), TensorOrder::vtk));
  for (const int needed : {0, 1, 3, parts.size() == 4 ? 2 : 0})
    if (std::count(positions.begin(), positions.end(), needed) != 1)
      throw std::invalid_argument(
          fmt::format("--array lists {} arrays, and their last two letters do not tell xx, yy, xy (and zz) of a tensor "
                      "of a plane; {}",
                      parts.size(), list_of_arrays(mesh)));
  vtkSmartPointer<vtkDataArray> joined = new_array(parts, 6, Take::tensor);
  joined->Fill(0);
  name_vtk_components(*joined);
  for (std::size_t i = 0; i < parts.size(); ++i)
    joined->CopyComponent(positions[i], parts[i].array, parts[i].component);
  return joined;
}

}  // namespace

bool is_array_list(vtkDataSet& mesh, const std::string& names) {
  return names.find(',') != std::string::npos && !mesh.GetPointData()->HasArray(names.c_str()) &&
         !mesh.GetCellData()->HasArray(names.c_str());
}

ArrayChoice join_arrays(vtkDataSet& mesh, const std::string& list, Take take, bool is_flat) {
  const Names names = names_in(mesh, list);
  vtkDataSetAttributes& data = attributes_with(mesh, names);
  const std::vector<Part> parts = parts_of(mesh, data, names, take, is_flat);
  const vtkSmartPointer<vtkDataArray> joined = is_plane(parts, take)  ? joined_of_plane(mesh, parts)
                                               : take == Take::tensor ? in_known_order(*joined_in_order(parts, take))
                                                                      : joined_in_order(parts, take);
  for (const std::string& name : names) data.RemoveArray(name.c_str());
  data.AddArray(joined);
  return {joined->GetName(), &data == static_cast<vtkDataSetAttributes*>(mesh.GetCellData())};
}

}  // namespace tensorray
