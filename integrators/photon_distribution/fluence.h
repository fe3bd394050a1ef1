#pragma once
/// The fluence of light inside the volume, for each voxel.

#include <atomic>
#include <cstdint>
#include <vector>

#include "base/process/archive.h"
#include "tracing/bending/bending.h"
#include "volumes/bricks/brick_index.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// Sums the lengths of rays in each of the field's own voxels:
///   fluence = Σ power · length of the ray in the voxel / volume of the voxel.
/// The units are the power and irradiance of the undisturbed beam, so that the fluence is 1 where light goes straight
/// within the beam. Only the part of a voxel within the volume's extent counts (the extent cuts the outermost voxels of
/// an axis in half). Volumes are those of these parts, so that outermost voxels also have a fluence of 1.
///
/// Sums are integers: lengths are rounded to 2^-32 of a voxel's edge (or to more, if there are very many rays). The
/// result therefore does not depend on the order of the rays. Sums are kept in blocks of 8³ voxels, for the blocks that
/// are in the field's memory. The rest of the extent, where nothing bends light, has no sums. Memory grows with the
/// number of blocks that light reaches, whatever the extent: eight bytes for each sum.
class FluenceSums {
 public:
  /// @param powers  Power of each channel, any unit; >= 0, at least one > 0.
  /// @param bands   Whether each channel has its own sums and its own grid; otherwise all channels share the sums.
  /// @param rays    Approximate number of rays that will be added. A sum has room for sixteen voxel edges of each ray.
  /// `field` must outlive the sums. @throw std::invalid_argument if there is no power.
  FluenceSums(const TensorField& field, std::vector<double> powers, bool bands, std::uint64_t rays);
  ~FluenceSums();
  FluenceSums(const FluenceSums&) = delete;
  FluenceSums& operator=(const FluenceSums&) = delete;

  /// Adds a ray of the channel. Any number of threads may add rays at once.
  void add(std::size_t channel, const RayRecord& ray);

  /// Writes the sums so far, or adds others; not while rays are added. @throw DamagedArchive if bands or field differ.
  void copy_sums(Archive& archive);

  /// The grids, as fog volumes: the one of all channels, then, with `bands`, one for each channel (1 is the undisturbed
  /// beam of that channel). Voxels that light has reached are active. The grids have no names yet. Runs on all threads.
  /// @param ray_area  Cross section of the beam that a ray of each channel stands for, world units².
  std::vector<ScalarGrid> grids(double ray_area) const;

  /// Do not call it while rays are added.
  std::size_t memory_bytes() const;

 private:
  using Sum = std::atomic<std::uint64_t>;

  std::size_t lit_blocks() const;
  Sum* sums_of(std::uint32_t block);
  ScalarGrid grid_of(std::size_t first_plane, const std::vector<double>& weights) const;

  const TensorField& field_;
  std::vector<double> powers_;  // Their sum is 1.
  bool bands_;
  std::size_t planes_;  // Number of sums of a voxel.
  double edge_;         // Edge of a voxel, world units; the unit of lengths.
  double quantum_;      // Value of the last bit of a sum, in edges.
  double max_power_;
  std::vector<Eigen::Vector3i> places_;    // Positions of the blocks, in units of blocks; in order.
  BrickIndex index_;                       // Finds the number of the block at a position.
  std::vector<std::atomic<Sum*>> blocks_;  // 8³ sums for each plane of a block; null where no light has been.
};

}  // namespace tensorray
