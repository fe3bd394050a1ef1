#include "tools/import/lattices/tensor_order.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tensorray {
namespace {

using Positions = std::array<int, 6>;

/// The positions of xx, yy, zz, xy, yz and xz among six components.
Positions positions(TensorOrder order) {
  switch (order) {
    case TensorOrder::fsl:
      return {0, 3, 5, 1, 4, 2};
    case TensorOrder::mrtrix:
      return {0, 1, 2, 3, 5, 4};
    case TensorOrder::voigt:
      return {0, 1, 2, 5, 3, 4};
    case TensorOrder::lower_triangle:
      return {0, 2, 5, 1, 4, 3};
    case TensorOrder::vtk:
    case TensorOrder::full:
    case TensorOrder::plane:
    case TensorOrder::two_by_two:
      break;
  }
  return {0, 1, 2, 3, 4, 5};
}

}  // namespace

const std::vector<std::string>& tensor_order_names() {
  static const std::vector<std::string> names = {"vtk", "fsl", "mrtrix", "voigt", "lower", "plane", "2x2"};
  return names;
}

TensorOrder tensor_order_of(const std::string& name) {
  constexpr std::array orders = {
      TensorOrder::vtk,   TensorOrder::fsl,       TensorOrder::mrtrix, TensorOrder::voigt, TensorOrder::lower_triangle,
      TensorOrder::plane, TensorOrder::two_by_two};
  const auto& names = tensor_order_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw std::invalid_argument(
        fmt::format("--order: unknown order \"{}\"; there are {}", name, fmt::join(names, ", ")));
  return orders[static_cast<std::size_t>(found - names.begin())];
}

int component_count(TensorOrder order) {
  if (order == TensorOrder::full) return 9;
  return order == TensorOrder::plane || order == TensorOrder::two_by_two ? 4 : 6;
}

TensorOrder chosen_order(int components, const std::optional<TensorOrder>& said,
                         const std::optional<TensorOrder>& given, const std::string& what) {
  if (given && (components == 9 || (said && *said != *given)))
    throw std::invalid_argument(what + " says its order itself: leave --order out (--frame says the axes of an image)");
  if (components == 9) return TensorOrder::full;
  const int count = components == 4 ? 4 : 6;
  const std::optional<TensorOrder> chosen = said ? said : given;
  if (chosen && component_count(*chosen) == count) return *chosen;
  if (components == 4)
    throw std::invalid_argument(
        what +
        " has four components of a tensor of a plane and does not say in which order: give it with --order plane (xx "
        "yy zz xy) or 2x2 (xx xy yx yy)");
  std::vector<std::string> orders;
  for (const std::string& name : tensor_order_names())
    if (component_count(tensor_order_of(name)) == count) orders.push_back(name);
  throw std::invalid_argument(
      fmt::format("{} has {} of a symmetric tensor and does not say in which order: give it with --order {}", what,
                  components == 6 ? "six components" : "the six components first", fmt::join(orders, "|")));
}

Eigen::Matrix3d tensor_of(const double* components, TensorOrder order) {
  if (order == TensorOrder::full) return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(components);
  const double* c = components;
  Eigen::Matrix3d tensor;
  if (order == TensorOrder::plane) {
    tensor << c[0], c[3], 0, c[3], c[1], 0, 0, 0, c[2];
    return tensor;
  }
  if (order == TensorOrder::two_by_two) {
    tensor << c[0], c[1], 0, c[2], c[3], 0, 0, 0, 0;
    return tensor;
  }
  const auto [xx, yy, zz, xy, yz, xz] = positions(order);
  tensor << c[xx], c[xy], c[xz], c[xy], c[yy], c[yz], c[xz], c[yz], c[zz];
  return tensor;
}

}  // namespace tensorray
