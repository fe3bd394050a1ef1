#pragma once
/// @file volumes/bricks/brick_index.h
/// Which of a list of bricks is at a place.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

namespace tensorray {

/// Numbers of bricks by their coordinates, in steps of a brick. Memory follows the number of bricks, not their extent:
/// a dense table over the box about them where that takes at most 256 bytes a brick (bricks themselves take 26,000), so
/// that finding one is one load from a table that caches hold; else a hash table. Immutable; any number of threads may
/// read it at once.
class BrickIndex {
 public:
  static constexpr std::uint32_t missing = 0xffffffffu;

  BrickIndex() = default;

  /// @param bricks  No two at one place; fewer than `missing`.
  explicit BrickIndex(const std::vector<Eigen::Vector3i>& bricks);

  /// The number of the brick in the list that this was made of, or `missing`. Any coordinates may be asked for.
  std::uint32_t find(const Eigen::Vector3i& brick) const {
    // Unsigned, what lies before the box is far behind it.
    const auto from = [&](int axis) { return static_cast<std::uint32_t>(brick[axis]) - first_[axis]; };
    const std::uint32_t x = from(0), y = from(1), z = from(2);
    if (x < size_[0] && y < size_[1] && z < size_[2])
      return table_[(static_cast<std::size_t>(x) * size_[1] + y) * size_[2] + z];
    return slots_.empty() ? missing : find_slot(brick);
  }

  std::size_t memory_bytes() const;

 private:
  struct Slot {
    Eigen::Vector3i brick;
    std::uint32_t index;  ///< `missing` if the slot is free.
  };

  void make_table(const std::vector<Eigen::Vector3i>& bricks, const Eigen::AlignedBox3i& box);
  void make_slots(const std::vector<Eigen::Vector3i>& bricks);
  std::size_t home_slot(const Eigen::Vector3i& brick) const;
  std::uint32_t find_slot(const Eigen::Vector3i& brick) const;

  std::array<std::uint32_t, 3> first_{}, size_{};  ///< Of the box that `table_` covers; without one its size is zero.
  std::vector<std::uint32_t> table_;
  std::vector<Slot> slots_;  ///< Open addressing; its size is a power of two, or zero where there is a table.
};

}  // namespace tensorray
