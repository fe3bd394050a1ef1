#include "tools/import/lattices/component_names.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <vtkDataArray.h>
#include <vtkSmartPointer.h>

#include "base/text/text.h"

namespace tensorray {
namespace {

/// The entry, or the one across the diagonal, that is not below it.
int upper(int entry) {
  const int row = entry / 3, column = entry % 3;
  return row > column ? 3 * column + row : entry;
}

/// Where each entry of a sorted tensor is among the components; empty if their names do not tell all entries once.
std::vector<int> places_of_entries(vtkDataArray& array) {
  const bool is_full = array.GetNumberOfComponents() == 9;
  const std::vector<int> entries = is_full ? std::vector{0, 1, 2, 3, 4, 5, 6, 7, 8} : std::vector{0, 4, 8, 1, 5, 2};
  std::vector<int> places(entries.size(), -1);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const int named = entry_named(component_name(array, static_cast<int>(i)));
    const auto entry = std::find(entries.begin(), entries.end(), is_full || named < 0 ? named : upper(named));
    if (entry == entries.end()) return {};
    places[static_cast<std::size_t>(entry - entries.begin())] = static_cast<int>(i);
  }
  return std::count(places.begin(), places.end(), -1) == 0 ? places : std::vector<int>();
}

}  // namespace

std::string component_name(vtkDataArray& array, int component) {
  const char* const name = array.GetComponentName(component);
  return name ? name : "";
}

int entry_named(const std::string& name) {
  if (name.size() < 2) return -1;
  int entry = 0;
  for (const char letter : lower_case(name.substr(name.size() - 2))) {
    const std::size_t axis = std::string("xyz123").find(letter);
    if (axis == std::string::npos) return -1;
    entry = 3 * entry + static_cast<int>(axis % 3);
  }
  return entry;
}

std::optional<TensorOrder> order_of_names(vtkDataArray& array) {
  std::vector<int> entries;
  const int count = array.GetNumberOfComponents() == 4 ? 4 : 6;
  for (int i = 0; i < count; ++i) {
    const int entry = entry_named(component_name(array, i));
    entries.push_back(entry < 0 ? entry : upper(entry));
  }
  constexpr int xx = 0, xy = 1, xz = 2, yy = 4, yz = 5, zz = 8;
  const std::pair<TensorOrder, std::vector<int>> orders[] = {
      {TensorOrder::plane, {xx, yy, zz, xy}},
      {TensorOrder::two_by_two, {xx, xy, xy, yy}},
      {TensorOrder::vtk, {xx, yy, zz, xy, yz, xz}},
      {TensorOrder::fsl, {xx, xy, xz, yy, yz, zz}},
      {TensorOrder::mrtrix, {xx, yy, zz, xy, xz, yz}},
      {TensorOrder::voigt, {xx, yy, zz, yz, xz, xy}},
      {TensorOrder::lower_triangle, {xx, xy, yy, xz, yz, zz}},
  };
  for (const auto& [order, named] : orders)
    if (entries == named) return order;
  return {};
}

vtkSmartPointer<vtkDataArray> sorted_by_names(vtkDataArray& array) {
  const int components = array.GetNumberOfComponents();
  if (components < 6) return &array;
  const std::vector<int> places = places_of_entries(array);
  if (places.empty() || std::is_sorted(places.begin(), places.end())) return &array;
  const auto sorted = vtkSmartPointer<vtkDataArray>::Take(array.NewInstance());
  sorted->SetName(array.GetName());
  sorted->SetNumberOfComponents(components);
  sorted->SetNumberOfTuples(array.GetNumberOfTuples());
  for (int i = 0; i < components; ++i) {
    const bool is_entry = i < static_cast<int>(places.size());
    const int from = is_entry ? places[static_cast<std::size_t>(i)] : i;
    sorted->CopyComponent(i, &array, from);
    sorted->SetComponentName(i, component_name(array, from).c_str());
  }
  return sorted;
}

vtkSmartPointer<vtkDataArray> in_known_order(vtkDataArray& array) {
  if (array.GetNumberOfComponents() != 9 && order_of_names(array)) return &array;
  return sorted_by_names(array);
}

}  // namespace tensorray
