#pragma once
/// Temporary files of voxels, the data sets, and checks of the results.

#include <array>
#include <complex>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <utility>

#include "tests/import/mesh_files.h"
#include "tests/volumes/grid_support.h"
#include "tools/import/lattices/lattice.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray::test {

using TemporaryFile = Temporary;

template <class Number>
std::string bytes_of(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

/// The components of a symmetric tensor: xx xy xz yy yz zz; and of any one, row by row.
inline std::vector<float> upper_triangle(const Eigen::Matrix3d& t) {
  return {static_cast<float>(t(0, 0)), static_cast<float>(t(0, 1)), static_cast<float>(t(0, 2)),
          static_cast<float>(t(1, 1)), static_cast<float>(t(1, 2)), static_cast<float>(t(2, 2))};
}
inline std::vector<float> rows(const Eigen::Matrix3d& t) {
  std::vector<float> numbers;
  for (int i = 0; i < 9; ++i) numbers.push_back(static_cast<float>(t(i / 3, i % 3)));
  return numbers;
}

inline Eigen::Matrix3d symmetric(const std::array<double, 6>& c) {
  return (Eigen::Matrix3d() << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5]).finished();
}

/// Reverses the bytes of a number.
template <class Number>
Number swapped(Number number) {
  auto* bytes = reinterpret_cast<char*>(&number);
  std::reverse(bytes, bytes + sizeof number);
  return number;
}

inline const Eigen::Matrix3f* voxel(const TensorGrid& grid, const Eigen::Vector3i& index) { return find(grid, index); }

inline TensorGrid tensors_of(const Lattice& lattice, std::optional<TensorOrder> order = {}) {
  LatticeReport report;
  return tensors_of(lattice, order, report);
}

/// The tensor of the first voxel of a file; NaN if it is inactive.
inline Eigen::Matrix3d first_tensor(const TensorGrid& grid) {
  const Eigen::Matrix3f* const tensor = voxel(grid, {0, 0, 0});
  return tensor ? Eigen::Matrix3d(tensor->cast<double>()) : Eigen::Matrix3d(Eigen::Matrix3d::Constant(NAN));
}

inline void for_each_voxel(const TensorGrid& grid,
                           const std::function<void(const Eigen::Vector3i&, const Eigen::Matrix3d&)>& visit) {
  for_each_active(
      grid, [&](const Eigen::Vector3i& index, const Eigen::Matrix3f& tensor) { visit(index, tensor.cast<double>()); });
}

inline std::pair<double, double> eigenvalues_of(const TensorGrid& grid) {
  std::pair<double, double> range{INFINITY, -INFINITY};
  for_each_voxel(grid, [&](const Eigen::Vector3i&, const Eigen::Matrix3d& tensor) {
    for (const std::complex<double> value : eigenvalues(tensor))
      range = {std::min(range.first, value.real()), std::max(range.second, value.real())};
  });
  return range;
}

/// Expects an exception of any type with a one-line message that contains `words`.
inline void expect_error(const std::function<void()>& run, const std::vector<std::string>& words) {
  try {
    run();
    ADD_FAILURE() << "no error, which should speak of " << words.front();
  } catch (const std::exception& error) {
    const std::string text = error.what();
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    for (const std::string& word : words) EXPECT_NE(text.find(word), std::string::npos) << text << "\nlacks " << word;
  }
}

/// Expects that a file with these bytes is refused, in one line with its name and `words`.
inline void refuses(Lattice (*open)(const std::filesystem::path&, bool), const std::string& name,
                    const std::string& bytes, std::vector<std::string> words = {}) {
  const TemporaryFile file(name, bytes);
  words.insert(words.begin(), name);
  expect_error([&] { tensors_of(open(file, false), TensorOrder::fsl); }, words);
}

inline Eigen::Matrix3d rotation() {
  return Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
}

/// A symmetric tensor that no permutation of the axes leaves unchanged.
inline Eigen::Matrix3d symmetric_tensor() {
  Eigen::Matrix3d tensor;
  tensor << 1.5, 0.25, -0.5, 0.25, 0.75, 0.125, -0.5, 0.125, 2;
  return tensor;
}

inline Eigen::Matrix3d general_tensor() {
  Eigen::Matrix3d tensor;
  tensor << 0.5, -1.25, 0.375, 0.75, -0.5, 1.0, -0.25, 0.625, 0.25;
  return tensor;
}

inline void expect_near(const Eigen::Matrix3d& expected, const Eigen::Matrix3f* found, double tolerance = 1e-6) {
  ASSERT_NE(found, nullptr);
  EXPECT_LT((found->cast<double>() - expected).norm(), tolerance * expected.norm()) << *found << "\nnot\n" << expected;
}

}  // namespace tensorray::test
