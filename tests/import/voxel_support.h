#pragma once
/// @file tests/import/voxel_support.h
/// Temporary files of voxels, the data sets, and checks of the results.

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "tests/import/mesh_files.h"
#include "tools/import/lattices/lattice.h"

namespace tensorray::test {

/// A path in the tests' temporary folder that no other process uses. The file is removed at the end.
class TemporaryFile : public std::filesystem::path {
 public:
  explicit TemporaryFile(const std::string& name) : path(testing::TempDir()) {
    *this /= "tensorray_" + std::to_string(::getpid()) + "_" + name;
  }
  TemporaryFile(const std::string& name, const std::string& contents) : TemporaryFile(name) { write(contents); }
  ~TemporaryFile() { std::filesystem::remove(*this); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(const std::string& contents) const { std::ofstream(*this, std::ios::binary) << contents; }
};

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

inline TensorGrid tensors_of(const Lattice& lattice, const std::string& order = "") {
  LatticeReport report;
  return tensors_of(lattice, order.empty() ? std::nullopt : std::optional(tensor_order_of(order)), report);
}

/// Calls `visit(index, tensor)` at the active voxels.
inline void for_each_voxel(const TensorGrid& grid,
                           const std::function<void(const Eigen::Vector3i&, const Eigen::Matrix3d&)>& visit) {
  for (const TensorBlock& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset])
        visit(block.origin + TensorBlock::position(offset), block.values[offset].cast<double>());
}

/// The least and the greatest eigenvalue of a symmetric field, and the number of voxels with a negative eigenvalue.
struct Spectrum {
  double least = INFINITY, greatest = -INFINITY;
  int negative = 0;
};

inline Spectrum spectrum_of(const TensorGrid& grid) {
  Spectrum spectrum;
  for_each_voxel(grid, [&](const Eigen::Vector3i&, const Eigen::Matrix3d& tensor) {
    const Eigen::Vector3d values = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(tensor).eigenvalues();
    spectrum.least = std::min(spectrum.least, values.minCoeff());
    spectrum.greatest = std::max(spectrum.greatest, values.maxCoeff());
    if (values.minCoeff() < 0) ++spectrum.negative;
  });
  return spectrum;
}

/// Counts how often fibres continue. At each voxel p with a fractional anisotropy above 0.5, the major eigenvector e,
/// rotated by `turn`, is compared with the major eigenvectors of such voxels at p ± step e; it counts if they differ
/// by less than half a radian. Tensors in a wrong frame have a lower count, because their fibres point out of the
/// bundles.
inline int coherence(const TensorGrid& grid, const Eigen::Matrix3d& turn, double step) {
  const auto major = [&](const Eigen::Matrix3d& tensor) -> Eigen::Vector3d {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(tensor);
    const Eigen::Vector3d values = solver.eigenvalues();
    const double anisotropy = std::sqrt(1.5) * (values.array() - values.mean()).matrix().norm() / values.norm();
    if (values[0] <= 0 || anisotropy < 0.5) return Eigen::Vector3d::Zero();
    return turn * solver.eigenvectors().col(2);
  };
  std::map<std::array<int, 3>, Eigen::Vector3d> directions;
  for_each_voxel(grid, [&](const Eigen::Vector3i& index, const Eigen::Matrix3d& tensor) {
    const Eigen::Vector3d direction = major(tensor);
    if (!direction.isZero()) directions[{index.x(), index.y(), index.z()}] = direction;
  });
  const Eigen::Affine3d to_index = grid.to_world.inverse();
  int count = 0;
  for (const auto& [index, here] : directions)
    for (const double side : {-step, step}) {
      const Eigen::Vector3d from = grid.to_world * Eigen::Vector3d(index[0], index[1], index[2]);
      const Eigen::Vector3i to = (to_index * (from + side * here)).array().round().cast<int>();
      const auto next = directions.find({to.x(), to.y(), to.z()});
      if (next != directions.end() && std::abs(here.dot(next->second)) > std::cos(0.5)) ++count;
    }
  return count;
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
inline void refuses(Lattice (*open)(const std::filesystem::path&), const std::string& name, const std::string& bytes,
                    std::vector<std::string> words = {}) {
  const TemporaryFile file(name, bytes);
  words.insert(words.begin(), name);
  expect_error([&] { tensors_of(open(file), "fsl"); }, words);
}

/// A rotation without any symmetry.
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
