#pragma once
/// NumPy arrays of C++ memory, and the other way round. All functions need the GIL.

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <pybind11/numpy.h>

namespace tensorray {

namespace py = pybind11;

using Shape = std::vector<py::ssize_t>;

/// Doubles in C order; other types and orders are converted.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// A read-only array of memory that `owner` keeps alive, and that the array keeps alive in turn. Nothing is copied.
/// @param strides  In bytes; empty: C order.
template <class T>
py::array view(const T* data, const Shape& shape, const py::object& owner, const Shape& strides = {}) {
  py::array array = strides.empty() ? py::array(py::dtype::of<T>(), shape, data, owner)
                                    : py::array(py::dtype::of<T>(), shape, strides, data, owner);
  array.attr("flags").attr("writeable") = false;
  return array;
}

/// An array that takes over a vector of values: numbers, or structs of nothing but `Number`s.
template <class Value, class Number = Value>
py::array taken(std::vector<Value> values, const Shape& shape) {
  static_assert(sizeof(Value) % sizeof(Number) == 0, "no padding");
  auto owned = std::make_unique<std::vector<Value>>(std::move(values));
  const auto* const data = reinterpret_cast<const Number*>(owned->data());
  const py::capsule owner(owned.release(), [](void* vector) { delete static_cast<std::vector<Value>*>(vector); });
  return py::array(py::dtype::of<Number>(), shape, data, owner);
}

/// The same for fixed-size Eigen matrices, whose numbers become further axes: `shape` has their columns before rows.
template <class Matrix>
py::array taken_matrices(std::vector<Matrix> values, const Shape& shape) {
  using Number = typename Matrix::Scalar;
  static_assert(sizeof(Matrix) == sizeof(Number) * Matrix::SizeAtCompileTime, "no padding");
  return taken<Matrix, Number>(std::move(values), shape);
}

/// @throw std::invalid_argument unless there are three numbers.
inline Eigen::Vector3d vector3(const Doubles& numbers, const char* name) {
  if (numbers.size() != 3) throw std::invalid_argument(std::string(name) + ": give three numbers");
  return Eigen::Vector3d(numbers.data());
}

/// A matrix as an array with rows first.
inline py::array rows_first(const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = matrix;
  return py::array(py::dtype::of<double>(), Shape{4, 4}, rows.data());
}

}  // namespace tensorray
