#include "tools/import/lattices/component_names.h"

#include <algorithm>
#include <vector>

#include <vtkDataArray.h>
#include <vtkSmartPointer.h>

#include "base/text/text.h"

namespace tensorray {
namespace {

/// The entry of a tensor that the last two letters of a name tell; −1 if they tell none.
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

/// Where each entry of a sorted tensor is among the components; empty if their names do not tell all entries once.
std::vector<int> places_of_entries(vtkDataArray& array) {
  const TensorOrder order = array.GetNumberOfComponents() == 9 ? TensorOrder::full : TensorOrder::vtk;
  std::vector<int> places(entries_of(order).size(), -1);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const int position = named_position(component_name(array, static_cast<int>(i)), order);
    if (position < 0) return {};
    places[static_cast<std::size_t>(position)] = static_cast<int>(i);
  }
  return std::count(places.begin(), places.end(), -1) == 0 ? places : std::vector<int>();
}

}  // namespace

std::string component_name(vtkDataArray& array, int component) {
  const char* const name = array.GetComponentName(component);
  return name ? name : "";
}

void name_vtk_components(vtkDataArray& array) {
  const char* const names[] = {"XX", "YY", "ZZ", "XY", "YZ", "XZ"};
  for (int component = 0; component < 6; ++component) array.SetComponentName(component, names[component]);
}

int named_position(const std::string& name, TensorOrder order) {
  const int named = entry_named(name);
  const std::vector<int>& entries = entries_of(order);
  const auto entry = std::find(entries.begin(), entries.end(), order == TensorOrder::full ? named : upper(named));
  return named < 0 || entry == entries.end() ? -1 : static_cast<int>(entry - entries.begin());
}

std::optional<TensorOrder> order_of_names(vtkDataArray& array) {
  const std::size_t count = array.GetNumberOfComponents() == 4 ? 4 : 6;
  for (const auto& [name, order] : tensor_orders()) {
    const std::vector<int>& entries = entries_of(order);
    bool fits = entries.size() == count;
    for (std::size_t i = 0; fits && i < count; ++i) {
      const int named = entry_named(component_name(array, static_cast<int>(i)));
      fits = named >= 0 && upper(named) == upper(entries[i]);
    }
    if (fits) return order;
  }
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
