#pragma once
/// Temporary files of voxels, the data sets, and checks of the results.

#include <cstring>
#include <functional>
#include <stdexcept>
#include <utility>

#include <Eigen/Eigenvalues>

#include "tests/import/mesh_files.h"
#include "tools/import/lattices/lattice.h"

namespace tensorray::test {

using TemporaryFile = Temporary;

template <class Number>
std::string bytes_of(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

/// The tensor at an index; null if the voxel is inactive.
inline const Eigen::Matrix3f* voxel(const TensorGrid& grid, const Eigen::Vector3i& index) {
  for (const TensorBlock& block : grid.blocks) {
    const Eigen::Vector3i p = index - block.origin;
    if ((p.array() < 0).any() || (p.array() >= TensorBlock::size).any()) continue;
    const int offset = TensorBlock::offset(p.x(), p.y(), p.z());
    return block.active[offset] ? &block.values[offset] : nullptr;
  }
  return nullptr;
}

inline TensorGrid tensors_of(const Lattice& lattice, std::optional<TensorOrder> order = {}) {
  LatticeReport report;
  return tensors_of(lattice, order, report);
}

inline void for_each_voxel(const TensorGrid& grid,
                           const std::function<void(const Eigen::Vector3i&, const Eigen::Matrix3d&)>& visit) {
  for (const TensorBlock& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset])
        visit(block.origin + TensorBlock::position(offset), block.values[offset].cast<double>());
}

inline std::pair<double, double> eigenvalues_of(const TensorGrid& grid) {
  std::pair<double, double> range{INFINITY, -INFINITY};
  for_each_voxel(grid, [&](const Eigen::Vector3i&, const Eigen::Matrix3d& tensor) {
    const Eigen::Vector3d values = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(tensor).eigenvalues();
    range = {std::min(range.first, values.minCoeff()), std::max(range.second, values.maxCoeff())};
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
