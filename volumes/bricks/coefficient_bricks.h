#pragma once
/// The bricks of a field while it is made: which voxels have coefficients, and where these are in memory. The
/// coefficients of a linear field are its values.

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "volumes/bricks/brick_layout.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// Finds blocks by their places (index of the first voxel / 8). Does not own the shapes.
struct BlockTable {
  explicit BlockTable(const std::vector<BlockShape>& shapes);

  const std::vector<BlockShape>& shapes;
  std::vector<Eigen::Vector3i> places;
  BrickIndex index;
};

/// Which of a block's 8³ voxels: a row along z is a byte, whose bit z is voxel (x, y, z); rows are at 8 x + y.
using VoxelMask = std::array<std::uint8_t, TensorBlock::size * TensorBlock::size>;

inline bool is_set(const VoxelMask& mask, int x, int y, int z) {
  return mask[static_cast<std::size_t>(x * TensorBlock::size + y)] >> z & 1;
}

/// The places about a block, and its own, which is the middle one: −1 to 1 along each axis.
constexpr int neighbour_count = 27;
inline Eigen::Vector3i neighbour(int n) { return {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1}; }

/// Numbers of places in CoefficientBricks.
using PlaceNumbers = std::vector<std::uint32_t>;

/// The bricks of a field. Each holds the coefficients of its own block of voxels, and those about it that its
/// cells need.
struct CoefficientBricks {
  /// First the bricks with a cell where the field is not zero, ordered by x, then y, then z. Then places of blocks that
  /// hold only coefficients of other bricks' cells: of the extent's last voxels.
  std::vector<Eigen::Vector3i> places;
  std::size_t count = 0;  ///< Number of the first ones.
  BrickIndex index;       ///< Of all places.

  /// The voxels of each place that have coefficients: the active ones, and inactive ones within the extent that are
  /// within a voxel of these (`fade`, of a cubic field) or two (`extend`) along each axis.
  std::vector<VoxelMask> filled;
  std::vector<VoxelMask> active;

  /// Of a finer level, the voxels that may have coefficients (finer_bricks.h); empty: all.
  std::vector<VoxelMask> free = {};

  /// All places, in slabs across x: what is made at a time (make_coefficients).
  std::vector<PlaceNumbers> slabs;
};

Eigen::Vector3i place_of(const Eigen::Vector3i& voxel);
VoxelMask mask_of(const BlockShape& shape);
bool any_of(const VoxelMask& mask);

/// Removes the voxels of a place that are outside the extent.
void cut(VoxelMask& mask, const Eigen::Vector3i& place, const Eigen::AlignedBox3i& extent);

/// Orders places by x, then y, then z, and removes those that are there twice.
void sort_places(std::vector<Eigen::Vector3i>& places);

/// The range of bricks that hold the cells between the voxels of a box. An axis with a single voxel has one cell.
Eigen::AlignedBox3i bricks_with_cells(const Eigen::AlignedBox3i& voxels);

/// CoefficientBricks::filled of places, from `active`. @param found  Finds the places.
std::vector<VoxelMask> filled_voxels(const std::vector<Eigen::Vector3i>& places, const BrickIndex& found,
                                     const std::vector<VoxelMask>& active, const Eigen::AlignedBox3i& extent,
                                     const Interpolant& interpolant);

/// Divides `places` in slabs: what is made at a time with the memory that there is.
void make_slabs(CoefficientBricks& bricks);

/// Places in slabs across x, in their order: each of at most `most` places, or with one place along x.
std::vector<PlaceNumbers> slabs_of(const std::vector<Eigen::Vector3i>& places, std::size_t most);

/// @param extent  As TensorField::voxels. @param interpolant  Of a linear field, `extend` only if it has a surface.
/// @param refined  Places that get a brick in any case. Runs on all threads.
CoefficientBricks coefficient_bricks(const BlockTable& table, const Eigen::AlignedBox3i& extent,
                                     const Interpolant& interpolant, const std::vector<Eigen::Vector3i>& refined = {});

/// The bricks of the level before a finer one.
struct CoarserLevel {
  const BrickIndex& index;
  const BrickMemory& memory;
};

/// The coefficients of all voxels, or their values before.
struct Coefficients {
  const CoefficientBricks& bricks;
  const Eigen::AlignedBox3i& extent;  ///< As TensorField::voxels.
  Interpolant interpolant;
  const BrickMemory& blocks;              ///< Of `bricks.places`, in the layout of CoefficientBlock.
  const CoarserLevel* coarser = nullptr;  ///< Of a finer level: what its bricks are added to.
};

/// What is stored of a coefficient, with T₂₂ last.
using StoredTensor = Eigen::Array<float, 9, 1>;

/// A voxel in the block at its place.
struct BlockVoxel {
  std::size_t block;
  int x, y, z;
};

StoredTensor read_coefficient(const BrickMemory& blocks, const BlockVoxel& voxel);

/// @param floats  A brick or a block. @param number  Of the coefficient in it.
template <class Layout>
void write_coefficient(const StoredTensor& value, int components, float* floats, int number) {
  std::copy_n(value.data(), components, floats + Layout::bending_offset(components, number));
  floats[Layout::trailing_offset(components) + number] = value[8];
}

/// The voxel at an index, if it is set in `masks`, which are `filled` or `active` of the bricks, or like them.
std::optional<BlockVoxel> find_voxel(const CoefficientBricks& bricks, const std::vector<VoxelMask>& masks,
                                     const Eigen::Vector3i& index);

/// Whether a voxel within the extent may have a coefficient. Where a place is missing, all about it may.
bool is_free(const CoefficientBricks& bricks, const Eigen::Vector3i& index);

}  // namespace tensorray
