#pragma once
/// Grids of tensors, and what is in them.

#include <cstring>
#include <functional>
#include <random>

#include "tests/names.h"
#include "volumes/grids/tensor_grid.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray {

/// Tensors that are not symmetric, and differ from voxel to voxel.
inline Eigen::Matrix3d waves(const Eigen::Vector3i& i) {
  return Eigen::Matrix3d::NullaryExpr([&](Eigen::Index row, Eigen::Index column) {
    const double at = 2.1 * static_cast<double>(row) + 0.9 * static_cast<double>(column);
    return std::sin(1.3 * i.x() + 0.7 * i.y() + 0.2 * i.z() + at);
  });
}

/// The matrix of nine numbers, row by row.
inline Eigen::Matrix3d by_rows(std::initializer_list<double> numbers) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers.begin());
}

/// From index to world, without a right angle.
inline Eigen::Affine3d sheared_transform() {
  Eigen::Affine3d to_world(Eigen::Translation3d(1, -2, 0.5));
  to_world.linear() = by_rows({0.5, 0.1, 0, -0.2, 0.3, 0.05, 0, 0.1, 0.8});
  return to_world;
}

/// Voxels from index `min` to `max`, of edge 1.
inline TensorGrid unit_voxels(const Eigen::Vector3i& min, const Eigen::Vector3i& max,
                              const std::function<Eigen::Matrix3d(const Eigen::Vector3i&)>& value) {
  return dense_grid({min, max}, Eigen::Affine3d::Identity(), value);
}

/// Calls visit(value) for the active voxels of all levels, always in the same order.
template <class Visit>
void for_each_value(TensorGrid& grid, const Visit& visit) {
  for (TensorBlocks* blocks : levels_of(grid))
    for (TensorBlock& block : *blocks)
      for (int offset = 0; offset < TensorBlock::voxels; ++offset)
        if (block.active[offset]) visit(block.values[offset]);
}

template <class Visit>
void for_each_active(const TensorBlocks& blocks, const Visit& visit) {
  for (const TensorBlock& block : blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset])
        visit(Eigen::Vector3i(block.origin + TensorBlock::position(offset)), block.values[offset]);
}

/// Of level 0.
template <class Visit>
void for_each_active(const TensorGrid& grid, const Visit& visit) {
  for_each_active(grid.blocks, visit);
}

/// The tensor of a voxel; null if it is not active.
inline const Eigen::Matrix3f* find(const TensorGrid& grid, const Eigen::Vector3i& index) {
  const Eigen::Matrix3f* found = nullptr;
  for_each_active(grid, [&](const Eigen::Vector3i& i, const Eigen::Matrix3f& value) {
    if (i == index) found = &value;
  });
  return found;
}

/// Takes the voxels away that `is_gone` names by their indices.
inline void clear_voxels(TensorBlocks& blocks, const std::function<bool(const Eigen::Vector3i&)>& is_gone) {
  for (TensorBlock& block : blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      if (!is_gone(block.origin + TensorBlock::position(offset))) continue;
      block.active.reset(offset);
      block.values[offset].setZero();
    }
  remove_empty_blocks(blocks);
}

inline Eigen::Vector3d random_point(std::mt19937& random, const Eigen::AlignedBox3d& box) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const Eigen::Vector3d part = Eigen::Vector3d::NullaryExpr([&] { return uniform(random); });
  return box.min() + part.cwiseProduct(box.sizes());
}

/// Values are compared bit for bit: NaN is the same as NaN.
inline void expect_same_blocks(const TensorBlocks& a, const TensorBlocks& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].origin, b[i].origin);
    EXPECT_EQ(a[i].active, b[i].active);
    EXPECT_EQ(std::memcmp(&a[i].values, &b[i].values, sizeof a[i].values), 0) << a[i].origin.transpose();
  }
}

/// Of level 0.
inline void expect_same_blocks(const TensorGrid& a, const TensorGrid& b) { expect_same_blocks(a.blocks, b.blocks); }

/// Preprocesses every voxel in place, as make_field does.
inline EigenvalueReport apply_eigenvalues(TensorGrid& grid, Eigenvalues mode) {
  const Eigenvalues chosen = mode == Eigenvalues::automatic ? automatic_choice(asymmetry(grid)) : mode;
  EigenvalueSums all;
  if (chosen != Eigenvalues::raw)
    for (TensorBlock& block : grid.blocks) all.add(apply_eigenvalues(block, chosen));
  return report_of(all, chosen);
}

}  // namespace tensorray
