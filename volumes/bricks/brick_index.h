#pragma once
/// Finds the brick that is at a given place.

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

namespace tensorray {

/// Maps the coordinates of bricks (voxel index / 8) to their numbers in a list, and to a value of each. Memory follows
/// the number of bricks, not their extent. The index is a dense table over the box of all bricks where that takes at
/// most 256 bytes per brick (a brick itself takes 18,000 to 48,000); finding a brick is then one load from a table that
/// fits in caches. Otherwise it is a hash table. Any number of threads may read it at once.
class BrickIndex {
 public:
  static constexpr std::uint32_t missing = 0xffffffffu;

  struct Entry {
    std::uint32_t number = missing;  ///< In the constructor's list.
    float value = 0;
  };

  BrickIndex() = default;

  /// @param bricks  All at different places; fewer than `missing`.
  explicit BrickIndex(const std::vector<Eigen::Vector3i>& bricks);

  /// Sets the values of all bricks. @param values  In the order of the constructor's list.
  void set_values(const std::vector<float>& values);

  /// The number of the brick in the constructor's list, or `missing`. Any coordinates are allowed.
  std::uint32_t find(const Eigen::Vector3i& brick) const { return entry(brick).number; }

  /// The same with the brick's value; 0 if it is missing.
  Entry entry(const Eigen::Vector3i& brick) const {
    // Unsigned differences wrap: coordinates below the box become very large and fail the test.
    const auto from = [&](int axis) { return static_cast<std::uint32_t>(brick[axis]) - first_[axis]; };
    const std::uint32_t x = from(0), y = from(1), z = from(2);
    if (x < size_[0] && y < size_[1] && z < size_[2])
      return table_[(static_cast<std::size_t>(x) * size_[1] + y) * size_[2] + z];
    return slots_.empty() ? Entry() : find_slot(brick);
  }

  std::size_t memory_bytes() const;

 private:
  struct Slot {
    Eigen::Vector3i brick;
    Entry entry;  ///< Its number is `missing` if the slot is free.
  };

  void make_table(const std::vector<Eigen::Vector3i>& bricks, const Eigen::AlignedBox3i& box);
  void make_slots(const std::vector<Eigen::Vector3i>& bricks);
  std::size_t home_slot(const Eigen::Vector3i& brick) const;
  Entry find_slot(const Eigen::Vector3i& brick) const;

  /// First brick and size of the box that `table_` covers; the size is zero if there is no table.
  std::array<std::uint32_t, 3> first_{}, size_{};
  std::vector<Entry> table_;
  std::vector<Slot> slots_;  ///< Hash table, open addressing. Its size is a power of two, or zero if `table_` is used.
};

}  // namespace tensorray
