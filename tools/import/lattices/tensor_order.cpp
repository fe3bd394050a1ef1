#include "tools/import/lattices/tensor_order.h"

#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tensorray {

const std::vector<std::pair<std::string, TensorOrder>>& tensor_orders() {
  static const std::vector<std::pair<std::string, TensorOrder>> orders = {{"vtk", TensorOrder::vtk},
                                                                          {"fsl", TensorOrder::fsl},
                                                                          {"mrtrix", TensorOrder::mrtrix},
                                                                          {"voigt", TensorOrder::voigt},
                                                                          {"lower", TensorOrder::lower_triangle},
                                                                          {"plane", TensorOrder::plane},
                                                                          {"2x2", TensorOrder::two_by_two}};
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

}  // namespace tensorray
