#pragma once
/// @file volumes/bricks/tensor_field.h
/// A tensor field that light can be traced through: immutable bricks in memory, sampled trilinearly.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "volumes/bricks/brick_index.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// 8³ cells with the far apron that interpolation needs: 9³ voxels. Bricks without an active voxel are all one brick of
/// zeros.
///
/// A tensor T is kept in two parts. What bends light is T − T₂₂ I, as a multiple of the identity bends nothing (Zheng
/// and Pang 2003, Eq. 5): its last component is zero, so that eight floats, one or two vector registers, are all that a
/// tracer reads. T₂₂ lies apart.
struct TensorBrick {
  static constexpr int cells = 8;
  static constexpr int width = cells + 1;  ///< Voxels along an edge, with the apron.
  static constexpr int voxels = width * width * width;
  static constexpr int bending_floats = 8;
  static constexpr int trailing_offset = voxels * bending_floats;                  ///< Of `trailing`, in floats.
  static constexpr int stored_floats = (trailing_offset + voxels + 15) / 16 * 16;  ///< Whole cache lines.

  static constexpr int voxel(int x, int y, int z) { return (x * width + y) * width + z; }

  const float* bending;   ///< Eight a voxel: T − T₂₂ I column by column, aligned to 32 bytes.
  const float* trailing;  ///< One a voxel: T₂₂.
  float strongest;  ///< No tensor within the brick has a deviator, T − ⅓ tr(T) I, of a greater Frobenius norm.

  Eigen::Matrix3d tensor(int voxel) const;  ///< T.
};

/// Bricks in memory, which grows with the active voxels and not with the extent. Immutable; any number of threads may
/// read it at once.
class TensorField {
 public:
  /// @throw std::invalid_argument if the grid has no active voxel or its transform cannot be inverted.
  explicit TensorField(const TensorGrid& grid);

  /// The same, giving back the grid's blocks on the way, so that there is never twice the field in memory.
  explicit TensorField(TensorGrid&& grid);

  const Eigen::Affine3d& to_world() const { return to_world_; }
  const Eigen::Affine3d& to_index() const { return to_index_; }

  /// The volume's extent in index space: from the least to the greatest active voxel, so that N voxels span N − 1. An
  /// axis with a single voxel spans that voxel, ±½, with the same tensor across.
  const Eigen::AlignedBox3d& index_bounds() const { return index_bounds_; }

  /// The box of the active voxels' centres, index space: `index_bounds` but for axes with a single voxel.
  const Eigen::AlignedBox3d& voxels() const { return voxels_; }

  /// The eight corners of the extent, world.
  std::vector<Eigen::Vector3d> corners() const;

  /// The box about them, along the world's axes.
  Eigen::AlignedBox3d world_box() const;

  /// Whether a point is inside the extent, its faces included.
  bool contains(const Eigen::Vector3d& world) const { return index_bounds_.contains(to_index_ * world); }

  /// The greatest Frobenius norm of a voxel.
  double greatest_norm() const;

  std::size_t brick_count() const { return bricks_.size(); }

  /// Where the bricks in memory are, in steps of a brick, ordered by x, then y, then z: those that hold an active voxel
  /// in a corner of one of their cells.
  const std::vector<Eigen::Vector3i>& bricks() const { return bricks_; }
  std::size_t memory_bytes() const;

  /// The brick that holds the cells from `brick` * 8 on. Those within the extent that hold no active voxel, and all
  /// others, are the brick of zeros.
  TensorBrick brick(const Eigen::Vector3i& brick) const {
    const std::uint32_t index = index_.find(brick);
    return index == BrickIndex::missing ? zeros : stored(index);
  }

  /// Whether the brick is in memory: if not, `brick` gives zeros.
  bool is_stored(const Eigen::Vector3i& brick) const { return index_.find(brick) != BrickIndex::missing; }

 private:
  static const TensorBrick zeros;

  struct Release {
    std::size_t bytes;

    void operator()(float* floats) const;
  };
  using Floats = std::unique_ptr<float[], Release>;

  template <class GiveBack>
  void make_bricks(const TensorGrid& grid, const GiveBack& give_back);
  static Floats allocate(std::size_t bricks);
  TensorBrick stored(std::size_t index) const {
    const float* const floats = floats_.get() + index * TensorBrick::stored_floats;
    return {floats, floats + TensorBrick::trailing_offset, strongest_[index]};
  }

  Eigen::Affine3d to_world_, to_index_;
  Eigen::AlignedBox3d index_bounds_, voxels_;
  std::vector<Eigen::Vector3i> bricks_;
  Floats floats_;                 ///< Brick after brick.
  std::vector<float> strongest_;  ///< Of each brick.
  BrickIndex index_;              ///< Which of them is at a place.
};

}  // namespace tensorray
