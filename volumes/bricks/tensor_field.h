#pragma once
/// A tensor field that light can be traced through: immutable bricks in memory, and what is between their voxels.

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "volumes/bricks/brick_index.h"
#include "volumes/bricks/brick_memory.h"
#include "volumes/grids/block_source.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

enum class Interpolation {
  /// Trilinear: continuous, with kinks at the faces of cells. Exact for fields that are linear along each axis.
  linear,
  /// The tricubic B-spline that has the voxels' values at the voxels: twice continuously differentiable (M. Unser,
  /// Splines: a perfect fit for signal and image processing, 1999). Exact for cubic polynomials along each axis, up to
  /// the faces of the extent, where values are extrapolated.
  cubic
};

/// What inactive voxels are taken for that are within the reach of active ones: in a cubic field, and in a linear one
/// that has a surface.
enum class Border {
  fade,   ///< A fifth of the active neighbour's value, then zero: the field fades out over two voxels.
  extend  ///< The continuation of the active voxels' values, so that the field goes on behind the last active voxel.
};

struct Interpolant {
  Interpolation between = Interpolation::linear;
  Border border = Border::fade;
};

inline bool operator==(const Interpolant& a, const Interpolant& b) {
  return a.between == b.between && (a.border == b.border || a.between == Interpolation::linear);
}
inline bool operator!=(const Interpolant& a, const Interpolant& b) { return !(a == b); }

/// 8³ cells, with the coefficients that interpolation needs in them (brick_layout.h): of a linear field the tensors at
/// 9³ voxels, of a cubic one those of a B-spline. All bricks without an active voxel share one brick of zeros.
///
/// A tensor T is stored in two parts. T − T₂₂ I bends light as T does, because a multiple of the identity bends nothing
/// (Zheng and Pang 2003, Eq. 5). Its last component is zero, so that eight floats suffice. If T = Tᵀ in all voxels of
/// the field, bit for bit, five of them are stored: those on and below the diagonal. T₂₂ is stored separately.
struct TensorBrick {
  static constexpr int cells = 8;

  /// Numbers of components of T − T₂₂ I that are stored: of any tensor, and of a symmetric one.
  static constexpr int general = 8, symmetric = 5;

  /// The number of the stored component that is component i, column by column, of T − T₂₂ I.
  static constexpr int stored_component(int components, int i) {
    constexpr int of_symmetric[] = {0, 1, 2, 1, 3, 4, 2, 4};
    return components == symmetric ? of_symmetric[i] : i;
  }

  const float* bending;   ///< T − T₂₂ I column by column: `components` a coefficient.
  const float* trailing;  ///< T₂₂: one float a coefficient.
  float strongest;        ///< Upper bound in the brick of the Frobenius norm of the deviator, T − ⅓ tr(T) I.
  int components;         ///< `general` or `symmetric`; the same in all bricks of a field.

  Eigen::Matrix3d tensor(int voxel) const;  ///< The tensor T at a voxel of a linear field.
};

/// The brick of the finest level at a point, whose cells are smaller than those of level 0 by `scale`.
struct LeafBrick {
  TensorBrick brick;
  std::array<float, 3>
      first{};      ///< Its first voxel, from that of the brick of level 0 that it is in, voxels of level 0.
  float scale = 1;  ///< 2 to the power of its level: its voxels along an edge of a voxel of level 0.
};

/// The bricks of a level, in the order of memory.
struct BrickList {
  std::vector<Eigen::Vector3i> places;  ///< Coordinates (voxel index of the level / 8), ordered by x, then y, then z.
  std::vector<float> strongest;         ///< TensorBrick::strongest of each.
};

/// What a field consists of.
struct FieldParts {
  Interpolant interpolant;
  Eigen::Affine3d to_world;
  Eigen::AlignedBox3i voxels;     ///< As `TensorField::voxels`.
  std::vector<BrickList> levels;  ///< At least one.
  TriangleMesh surface;
  BrickMemory memory;  ///< Of all levels, one after the other.
  double max_norm = 0;
};

/// A field as bricks in memory. Its size grows with the number of active voxels, not with the extent. Immutable; any
/// number of threads may read it at once. Copies share the voxels.
class TensorField {
 public:
  /// Reads each block once, on all threads. The voxels of a cubic field must be finite: one that is not spoils all
  /// about it.
  /// @throw std::invalid_argument if there is no active voxel or the transform cannot be inverted, or if there are
  /// finer levels and the field is not cubic; what `source` throws.
  explicit TensorField(const BlockSource& source, const Interpolant& interpolant = {});

  /// The same from a grid.
  explicit TensorField(const TensorGrid& grid, const Interpolant& interpolant = {});

  /// The same from bricks that are made.
  explicit TensorField(FieldParts parts);

  const Eigen::Affine3d& to_world() const { return to_world_; }
  const Eigen::Affine3d& to_index() const { return to_index_; }

  /// The volume's extent in index space: from the least to the greatest active voxel, so that N voxels span N − 1. An
  /// axis with a single voxel spans that voxel ±½, and the tensor is constant along it. Where the body's surface
  /// reaches beyond, it has whole voxels about the surface, at most `most_beyond` of them on each side.
  const Eigen::AlignedBox3d& index_bounds() const { return index_bounds_; }
  static constexpr int most_beyond = 2;

  /// The box of the voxels' centres, index space. It differs from `index_bounds` only along axes with a single voxel.
  const Eigen::AlignedBox3d& voxels() const { return voxels_; }

  /// The surface of the body that the field is in (TensorGrid::surface).
  const TriangleMesh& surface() const { return *surface_; }

  /// How far the surface reaches beyond the extent, voxels; 0: it does not.
  double surface_beyond() const;

  /// The eight corners of the extent, world space.
  std::vector<Eigen::Vector3d> corners() const;

  /// The axis-aligned box that encloses `corners`, world space.
  Eigen::AlignedBox3d world_box() const;

  /// Whether a point is inside the extent or on its faces.
  bool contains(const Eigen::Vector3d& world) const { return index_bounds_.contains(to_index_ * world); }

  /// The greatest Frobenius norm of all voxels.
  double max_norm() const { return max_norm_; }

  /// Whether T = Tᵀ in all voxels, bit for bit. Bricks then store five components, and tracing is faster.
  bool is_symmetric() const { return memory_.components == TensorBrick::symmetric; }

  const Interpolant& interpolant() const { return interpolant_; }
  bool is_cubic() const { return interpolant_.between == Interpolation::cubic; }

  std::size_t brick_count() const { return memory_.count; }  ///< Of all levels.

  /// Coordinates (voxel index / 8) of the bricks of level 0 in memory, ordered by x, then y, then z. A brick is in
  /// memory if an active voxel is at a corner of one of its cells or, of a cubic field, if a coefficient that one of
  /// its cells needs is not zero, or if it is refined.
  const std::vector<Eigen::Vector3i>& bricks() const { return bricks_[0].places; }

  /// The bricks of all levels. In those that are refined, `strongest` is a bound of the bricks within them, too.
  const std::vector<BrickList>& bricks_of_levels() const { return bricks_; }
  std::size_t memory_bytes() const;

  const BrickMemory& memory() const { return memory_; }

  /// Keeps something until the bricks are freed.
  void keep_with_bricks(std::shared_ptr<const void> other);

  /// The brick whose first cell is at `brick` * 8. It is the brick of zeros wherever no brick is in memory, also
  /// outside the extent. It is of level 0; where it is refined, its `strongest` is a bound of all finer bricks within.
  TensorBrick brick(const Eigen::Vector3i& brick) const {
    const BrickIndex::Entry entry = index_.entry(brick);
    return brick_at(entry.number == BrickIndex::missing ? zeros : memory_.brick(entry.number), entry.value);
  }

  /// Number of levels; 1 if all voxels have one size.
  int levels() const { return static_cast<int>(bricks_.size()); }

  /// The brick of the finest level that holds a point. It may be the brick of zeros.
  /// @param at  The brick of level 0. @param position  From its first voxel, in voxels of level 0; what is outside of
  /// the brick is taken as on its faces.
  LeafBrick leaf(const Eigen::Vector3i& at, const std::array<float, 3>& position) const {
    if (families_.empty()) return {brick(at)};
    return leaf_within(index_.entry(at), position);
  }

  /// Whether the brick is in memory. If not, `brick` returns the brick of zeros.
  bool is_stored(const Eigen::Vector3i& brick) const { return index_.find(brick) != BrickIndex::missing; }

 private:
  static const float* const zeros;  // A brick of either kind.

  using Family = std::array<BrickIndex::Entry, 8>;  ///< The bricks within a refined one: x slowest, z fastest.

  void make_indices();
  LeafBrick leaf_within(BrickIndex::Entry entry, const std::array<float, 3>& position) const;
  TensorBrick brick_at(const float* floats, float strongest) const {
    return {floats, floats + trailing_offset_, strongest, memory_.components};
  }

  Interpolant interpolant_;
  Eigen::Affine3d to_world_, to_index_;
  Eigen::AlignedBox3d index_bounds_, voxels_;
  std::vector<BrickList> bricks_;  ///< Of each level.
  BrickMemory memory_;             ///< In the order of `bricks_`.
  std::shared_ptr<const TriangleMesh> surface_;
  std::size_t trailing_offset_ = 0;
  double max_norm_ = 0;
  BrickIndex index_;  ///< Finds a brick of level 0, and its TensorBrick::strongest, by its coordinates.

  std::vector<Family> families_;
  std::vector<std::uint32_t> family_of_;  ///< By the number of a brick in memory; BrickIndex::missing: not refined.
};

/// Where the volume begins and ends along a direction, as signed distances from an origin, world units.
struct DepthRange {
  double near = 0, far = 0;
};

/// @param direction  Unit.
DepthRange depth_range(const TensorField& field, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

}  // namespace tensorray
