#include "tools/import/meshes/component_arrays.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>

#include "base/text.h"
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
vtkSmartPointer<vtkDataArray> new_array(vtkDataSetAttributes& data, const Names& names, int components) {
  const auto type_of = [&](const std::string& name) { return data.GetArray(name.c_str())->GetDataType(); };
  const int first = type_of(names.front());
  const bool same = std::all_of(names.begin(), names.end(), [&](const auto& name) { return type_of(name) == first; });
  vtkSmartPointer<vtkDataArray> array;
  array.TakeReference(vtkDataArray::CreateDataArray(same ? first : VTK_DOUBLE));
  array->SetName(tensor_array);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(data.GetArray(names.front().c_str())->GetNumberOfTuples());
  return array;
}

ArrayChoice replace(vtkDataSet& mesh, vtkDataSetAttributes& data, const Names& names, vtkDataArray& joined) {
  for (const std::string& name : names) data.RemoveArray(name.c_str());
  data.AddArray(&joined);
  return {tensor_array, &data == static_cast<vtkDataSetAttributes*>(mesh.GetCellData())};
}

/// The position in VTK's order of the component that the last two letters of a name tell; −1 if they tell none of a
/// plane.
int plane_position(const std::string& name) {
  const std::string axes = lower_case(name.size() < 2 ? "" : name.substr(name.size() - 2));
  for (const auto& [letters, position] : {std::pair("xx", 0),
                                          {"yy", 1},
                                          {"zz", 2},
                                          {"xy", 3},
                                          {"yx", 3},
                                          {"11", 0},
                                          {"22", 1},
                                          {"33", 2},
                                          {"12", 3},
                                          {"21", 3}})
    if (axes == letters) return position;
  return -1;
}

/// Joins the components xx, yy, xy, and perhaps zz, of a tensor in the plane of x and y; the others are zero.
ArrayChoice join_plane(vtkDataSet& mesh, const Names& names) {
  vtkDataSetAttributes& data = attributes_with(mesh, names);
  check_scalars(mesh, data, names);
  std::vector<int> positions;
  for (const std::string& name : names) positions.push_back(plane_position(name));
  for (const int needed : {0, 1, 3, names.size() == 4 ? 2 : 0})
    if (std::count(positions.begin(), positions.end(), needed) != 1)
      throw std::invalid_argument(
          "--array lists " + std::to_string(names.size()) +
          " arrays, and their last two letters do not tell xx, yy, xy (and zz) of a tensor of a plane; " +
          list_of_arrays(mesh));
  const vtkSmartPointer<vtkDataArray> joined = new_array(data, names, 6);
  joined->Fill(0);
  constexpr const char* vtk_names[] = {"XX", "YY", "ZZ", "XY", "YZ", "XZ"};
  for (int i = 0; i < 6; ++i) joined->SetComponentName(i, vtk_names[i]);
  for (std::size_t i = 0; i < names.size(); ++i)
    joined->CopyComponent(positions[i], data.GetArray(names[i].c_str()), 0);
  return replace(mesh, data, names, *joined);
}

}  // namespace

bool is_array_list(vtkDataSet& mesh, const std::string& names) {
  return names.find(',') != std::string::npos && !mesh.GetPointData()->HasArray(names.c_str()) &&
         !mesh.GetCellData()->HasArray(names.c_str());
}

ArrayChoice join_arrays(vtkDataSet& mesh, const std::string& list) {
  const Names names = names_in(list);
  if (names.size() == 3 || names.size() == 4) return join_plane(mesh, names);
  if (names.size() != 6 && names.size() != 9)
    throw std::invalid_argument(
        fmt::format("--array lists {} arrays, and a tensor has 6 or 9 components, of a plane 3 or "
                    "4; {}",
                    names.size(), list_of_arrays(mesh)));
  vtkDataSetAttributes& data = attributes_with(mesh, names);
  check_scalars(mesh, data, names);
  const vtkSmartPointer<vtkDataArray> joined = new_array(data, names, static_cast<int>(names.size()));
  for (int i = 0; i < joined->GetNumberOfComponents(); ++i) {
    const std::string& name = names[static_cast<std::size_t>(i)];
    joined->CopyComponent(i, data.GetArray(name.c_str()), 0);
    joined->SetComponentName(i, name.c_str());
  }
  return replace(mesh, data, names, *joined);
}

}  // namespace tensorray
