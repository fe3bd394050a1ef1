#include "tools/import/meshes/component_arrays.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>

#include "tools/import/meshes/mesh_tensors.h"

namespace tensorray {
namespace {

using Names = std::vector<std::string>;

Names names_in(const std::string& list) {
  Names names;
  std::istringstream stream(list + ",");  // getline drops an empty name at the end
  for (std::string name; std::getline(stream, name, ',');) {
    name.erase(name.find_last_not_of(' ') + 1);
    name.erase(0, name.find_first_not_of(' '));
    names.push_back(name);
  }
  return names;
}

/// The first of `names` that is no array of `data`; null if all are.
const std::string* missing_name(vtkDataSetAttributes& data, const Names& names) {
  const auto found = std::find_if(names.begin(), names.end(), [&](const auto& n) { return !data.GetArray(n.c_str()); });
  return found == names.end() ? nullptr : &*found;
}

void check_scalars(vtkDataSet& mesh, vtkDataSetAttributes& data, const Names& names) {
  for (const std::string& name : names) {
    const int components = data.GetArray(name.c_str())->GetNumberOfComponents();
    if (components != 1)
      throw std::invalid_argument(
          fmt::format("array \"{}\" has {} components, and each array of a list is one "
                      "component (--array); {}",
                      name, components, list_of_arrays(mesh)));
  }
}

/// The attributes, of points or else of cells, that have all the arrays.
vtkDataSetAttributes& attributes_with(vtkDataSet& mesh, const Names& names) {
  vtkDataSetAttributes &points = *mesh.GetPointData(), &cells = *mesh.GetCellData();
  if (!missing_name(points, names)) return points;
  if (!missing_name(cells, names)) return cells;
  for (const std::string& name : names)
    if (!points.GetArray(name.c_str()) && !cells.GetArray(name.c_str()))
      throw std::invalid_argument(fmt::format("no array \"{}\" (--array); {}", name, list_of_arrays(mesh)));
  throw std::invalid_argument("some arrays of the list are at points, others at cells (--array); " +
                              list_of_arrays(mesh));
}

/// An array for the components, of their type if they have the same.
vtkSmartPointer<vtkDataArray> new_array(vtkDataSetAttributes& data, const Names& names) {
  const auto type_of = [&](const std::string& name) { return data.GetArray(name.c_str())->GetDataType(); };
  const int first = type_of(names.front());
  const bool same = std::all_of(names.begin(), names.end(), [&](const auto& name) { return type_of(name) == first; });
  vtkSmartPointer<vtkDataArray> array;
  array.TakeReference(vtkDataArray::CreateDataArray(same ? first : VTK_DOUBLE));
  array->SetName(tensor_array);
  array->SetNumberOfComponents(static_cast<int>(names.size()));
  array->SetNumberOfTuples(data.GetArray(names.front().c_str())->GetNumberOfTuples());
  return array;
}

}  // namespace

bool is_array_list(vtkDataSet& mesh, const std::string& names) {
  return names.find(',') != std::string::npos && !mesh.GetPointData()->HasArray(names.c_str()) &&
         !mesh.GetCellData()->HasArray(names.c_str());
}

ArrayChoice join_arrays(vtkDataSet& mesh, const std::string& list) {
  const Names names = names_in(list);
  if (names.size() != 6 && names.size() != 9)
    throw std::invalid_argument(fmt::format("--array lists {} arrays, and a tensor has 6 or 9 components; {}",
                                            names.size(), list_of_arrays(mesh)));
  vtkDataSetAttributes& data = attributes_with(mesh, names);
  check_scalars(mesh, data, names);
  const vtkSmartPointer<vtkDataArray> joined = new_array(data, names);
  for (int i = 0; i < joined->GetNumberOfComponents(); ++i) {
    const std::string& name = names[static_cast<std::size_t>(i)];
    joined->CopyComponent(i, data.GetArray(name.c_str()), 0);
    joined->SetComponentName(i, name.c_str());
  }
  for (const std::string& name : names) data.RemoveArray(name.c_str());
  data.AddArray(joined);
  return {tensor_array, &data == static_cast<vtkDataSetAttributes*>(mesh.GetCellData())};
}

}  // namespace tensorray
