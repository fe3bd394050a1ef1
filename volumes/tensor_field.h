#pragma once
/// @file volumes/tensor_field.h
/// A tensor field that light can be traced through: immutable bricks in memory, sampled trilinearly.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "volumes/tensor_grid.h"

namespace tensorray {

/// Bricks of 8³ cells with the far apron that interpolation needs (9³ voxels), nine floats a voxel, contiguous.
/// Bricks without an active voxel are not stored: memory grows with the active voxels, not with the extent.
/// Immutable; any number of threads may read it at once, each through its own TensorSampler.
class TensorField {
 public:
  static constexpr int brick_cells = 8;
  static constexpr int brick_width = brick_cells + 1;  ///< Voxels along an edge, with the apron.
  static constexpr int voxel_floats = 9;               ///< Column by column, as Eigen stores them.
  static constexpr int brick_floats = brick_width * brick_width * brick_width * voxel_floats;

  /// @throw std::invalid_argument if the grid has no active voxel or its transform cannot be inverted.
  explicit TensorField(const TensorGrid& grid);

  const Eigen::Affine3d& to_world() const { return to_world_; }
  const Eigen::Affine3d& to_index() const { return to_index_; }

  /// The volume's extent in index space: from the least to the greatest active voxel, so that N voxels span N − 1. An
  /// axis with a single voxel spans that voxel, ±½, with the same tensor across.
  const Eigen::AlignedBox3d& index_bounds() const { return index_bounds_; }

  /// The box of the active voxels' centres, index space: `index_bounds` but for axes with a single voxel.
  const Eigen::AlignedBox3d& voxels() const { return voxels_; }

  /// The eight corners of the extent, world.
  std::vector<Eigen::Vector3d> corners() const;

  /// Whether a point is inside the extent, its faces included.
  bool contains(const Eigen::Vector3d& world) const { return index_bounds_.contains(to_index_ * world); }

  /// The greatest Frobenius norm of a voxel.
  double greatest_norm() const;

  /// This field with every tensor multiplied by `factor`, in place.
  TensorField scaled(double factor) &&;

  std::size_t brick_count() const { return bricks_.size() / brick_floats; }
  std::size_t memory_bytes() const;

  /// The floats of the brick that holds the cells from `brick` * 8 on, or the shared zero brick. Never null.
  /// Voxel (x, y, z), 0 to 8, starts at ((x * 9 + y) * 9 + z) * 9.
  const float* brick(const Eigen::Vector3i& brick) const;

 private:
  struct Slot {
    Eigen::Vector3i brick;
    std::uint32_t index;  ///< In units of brick_floats; `empty_slot` if the slot is free.
  };
  static constexpr std::uint32_t empty_slot = 0xffffffffu;

  void make_table(const std::vector<Eigen::Vector3i>& bricks);
  std::size_t home_slot(const Eigen::Vector3i& brick) const;

  Eigen::Affine3d to_world_, to_index_;
  Eigen::AlignedBox3d index_bounds_, voxels_;
  std::vector<float> bricks_;
  std::vector<Slot> slots_;  ///< Open-addressing hash table of the bricks; its size is a power of two.
};

/// Samples a field, which must outlive it. Cheap to make; one belongs to one thread (it remembers the last brick).
/// Points outside the extent are taken to the nearest point on it: the tracer knows what is inside.
class TensorSampler {
 public:
  explicit TensorSampler(const TensorField& field) : field_(&field) {}

  /// Trilinear interpolation at a world position, in world axes; inactive voxels count as zero.
  Eigen::Matrix3d at(const Eigen::Vector3d& world);

  /// The same, with the derivatives of the interpolation along two world vectors, the columns of `along`; at a cell's
  /// face those of one side.
  Eigen::Matrix3d at(const Eigen::Vector3d& world, const Eigen::Matrix<double, 3, 2>& along,
                     std::array<Eigen::Matrix3d, 2>& derivatives);

  std::uint64_t samples() const { return samples_; }  ///< Calls of `at` so far.

 private:
  const float* locate(const Eigen::Vector3d& world, Eigen::Vector3d& fraction);

  const TensorField* field_;
  Eigen::Vector3i brick_ = Eigen::Vector3i::Constant(INT32_MIN);
  const float* floats_ = nullptr;
  std::uint64_t samples_ = 0;
};

}  // namespace tensorray
