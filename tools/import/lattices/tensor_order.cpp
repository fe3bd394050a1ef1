#include "tools/import/lattices/tensor_order.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>
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

const std::vector<std::pair<std::string, TensorOrder>>& tensor_orders() {
  using Order = TensorOrder;
  static const std::vector<std::pair<std::string, Order>> orders = {{"vtk", Order::vtk},
                                                                    {"fsl", Order::fsl},
                                                                    {"mrtrix", Order::mrtrix},
                                                                    {"voigt", Order::voigt},
                                                                    {"lower", Order::lower_triangle},
                                                                    {"plane", Order::plane},
                                                                    {"2x2", Order::two_by_two}};
  return orders;
}

const std::vector<int>& entries_of(TensorOrder order) {
  constexpr int xx = 0, xy = 1, xz = 2, yx = 3, yy = 4, yz = 5, zz = 8;
  static const std::vector<std::vector<int>> entries = {
      // In the order of TensorOrder.
      {xx, yy, zz, xy, yz, xz}, {xx, xy, xz, yy, yz, zz}, {xx, yy, zz, xy, xz, yz}, {xx, yy, zz, yz, xz, xy},
      {xx, xy, yy, xz, yz, zz}, {xx, yy, zz, xy},         {xx, xy, yx, yy},         {0, 1, 2, 3, 4, 5, 6, 7, 8}};
  return entries[static_cast<std::size_t>(order)];
}

TensorOrder chosen_order(int components, const std::optional<TensorOrder>& said,
                         const std::optional<TensorOrder>& given, const std::string& what) {
  if (given && (components == 9 || (said && *said != *given)))
    throw std::invalid_argument(what + " says its order itself: leave --order out (--frame says the axes of an image)");
  if (components == 9) return TensorOrder::full;
  const std::size_t count = components == 4 ? 4 : 6;
  const std::optional<TensorOrder> chosen = said ? said : given;
  if (chosen && entries_of(*chosen).size() == count) return *chosen;
  if (components == 4)
    throw std::invalid_argument(
        what +
        " has four components of a tensor of a plane and does not say in which order: give it with --order plane (xx "
        "yy zz xy) or 2x2 (xx xy yx yy)");
  std::vector<std::string> names;
  for (const auto& [name, order] : tensor_orders())
    if (entries_of(order).size() == count) names.push_back(name);
  throw std::invalid_argument(
      fmt::format("{} has {} of a symmetric tensor and does not say in which order: give it with --order {}", what,
                  components == 6 ? "six components" : "the six components first", fmt::join(names, "|")));
}

Eigen::Matrix3d tensor_of(const double* components, TensorOrder order) {
  const bool is_symmetric = order != TensorOrder::full && order != TensorOrder::two_by_two;
  Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();
  for (const int entry : entries_of(order)) {
    if (is_symmetric) tensor(entry % 3, entry / 3) = *components;
    tensor(entry / 3, entry % 3) = *components++;
  }
  return tensor;
}

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
