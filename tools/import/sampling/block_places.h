#pragma once
/// The blocks of a lattice that are sampled.

#include <bitset>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// Voxels of a block.
using VoxelSet = std::bitset<TensorBlock::voxels>;

/// Numbers the blocks of a lattice: all, or the eight in each refined brick of the level before.
class BlockPlaces {
 public:
  /// @param size  Voxels of the lattice.
  explicit BlockPlaces(const Eigen::Vector3i& size) : extent_(blocks_of(size)) {}

  /// @param refined  Of each block of the level before, by its number there, whether its brick is refined.
  BlockPlaces(const Eigen::Vector3i& size, const BlockPlaces& before, const std::vector<bool>& refined)
      : extent_(blocks_of(size)),
        parent_extent_(before.extent_),
        number_(dense(parent_extent_, parent_extent_.x(), 0, 0), -1) {
    for (std::size_t i = 0; i < refined.size(); ++i) {
      if (!refined[i]) continue;
      const Eigen::Vector3i place = before.place(i);
      number_[dense(parent_extent_, place.x(), place.y(), place.z())] = static_cast<int>(parents_.size());
      parents_.push_back(place);
    }
  }

  /// Of all numbers; some may belong to blocks beyond the lattice.
  std::size_t count() const {
    return parent_extent_.isZero() ? dense(extent_, extent_.x(), 0, 0) : 8 * parents_.size();
  }
  const Eigen::Vector3i& extent() const { return extent_; }  ///< Blocks along each axis.

  /// Number of the block at a place (index of its first voxel / 8) within the lattice; nothing if it is not sampled.
  std::optional<std::size_t> number(int x, int y, int z) const {
    if (parent_extent_.isZero()) return dense(extent_, x, y, z);
    const int parent = number_[dense(parent_extent_, x / 2, y / 2, z / 2)];
    if (parent < 0) return {};
    return 8 * static_cast<std::size_t>(parent) + static_cast<std::size_t>(4 * (x % 2) + 2 * (y % 2) + z % 2);
  }

  Eigen::Vector3i place(std::size_t number) const {
    if (!parent_extent_.isZero()) {
      const auto child = static_cast<int>(number % 8);
      return 2 * parents_[number / 8] + Eigen::Vector3i(child / 4, child / 2 % 2, child % 2);
    }
    const auto ny = static_cast<std::size_t>(extent_.y()), nz = static_cast<std::size_t>(extent_.z());
    return {static_cast<int>(number / nz / ny), static_cast<int>(number / nz % ny), static_cast<int>(number % nz)};
  }

 private:
  static Eigen::Vector3i blocks_of(const Eigen::Vector3i& size) {
    return (size.array() + (TensorBlock::size - 1)) / TensorBlock::size;
  }
  static std::size_t dense(const Eigen::Vector3i& extent, int x, int y, int z) {
    return (static_cast<std::size_t>(x) * static_cast<std::size_t>(extent.y()) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(extent.z()) +
           static_cast<std::size_t>(z);
  }

  Eigen::Vector3i extent_, parent_extent_ = Eigen::Vector3i::Zero();  ///< The latter is zero if all are sampled.
  std::vector<int> number_;               ///< Of a brick of the level before among the refined ones; −1: it is none.
  std::vector<Eigen::Vector3i> parents_;  ///< The refined ones.
};

}  // namespace tensorray
