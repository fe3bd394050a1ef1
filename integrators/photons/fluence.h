#pragma once
/// @file integrators/photons/fluence.h
/// The light inside the volume: how much of it there is at each voxel.

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "integrators/bending/bending.h"
#include "volumes/bricks/brick_index.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/grids/scalar_grid.h"

namespace tensorray {

/// Sums the ways of rays voxel by voxel, in the field's own voxels:
///   fluence = Σ power · length of the way in the voxel / volume of the voxel,
/// with power and irradiance of the undisturbed beam as units: where light goes straight it is 1, throughout the beam.
/// Of the outermost voxels only the part counts that the volume's extent leaves of them (those of an axis are cut in
/// half by it): their volume is that part's, so that they, too, have 1.
///
/// Sums are integers, of lengths rounded to 2^-32 of a voxel's edge (or more, where very many rays need the room), so
/// that they are the same in whatever order rays come. They are kept in the blocks of 8³ voxels that are in the field's
/// memory: in the rest of the extent, where nothing bends light, none is. Memory follows those of them that light
/// reaches, however large the extent: eight bytes for each sum.
class FluenceSums {
 public:
  /// @param powers  Of the channels, any unit; >= 0, one of them > 0.
  /// @param bands   Whether each channel has a sum of its own, for one grid each; or all share one.
  /// @param rays    That will be added, about: sums have room for sixteen voxels' edges of each in one voxel.
  /// `field` must outlive the sums. @throw std::invalid_argument if there is no power.
  FluenceSums(const TensorField& field, std::vector<double> powers, bool bands, std::uint64_t rays);
  ~FluenceSums();
  FluenceSums(const FluenceSums&) = delete;
  FluenceSums& operator=(const FluenceSums&) = delete;

  /// Adds a ray of the channel. Any number of threads may add at once.
  void add(std::size_t channel, const Track& track);

  /// The grids, fog volumes, active where light has been: that of all channels, and then, with `bands`, that of each
  /// one (1 is its own undisturbed beam). They are not named yet. Runs on all threads.
  /// @param ray_area  Cross section of the beam that a ray of each channel stands for, world units².
  std::vector<ScalarGrid> grids(double ray_area) const;

  /// Not while rays are added.
  std::size_t memory_bytes() const;

 private:
  using Sum = std::atomic<std::uint64_t>;

  Sum* sums_of(std::uint32_t block);
  ScalarGrid grid_of(std::size_t first_plane, const std::vector<double>& weights) const;

  const TensorField& field_;
  std::vector<double> powers_;  // Their sum is 1.
  bool bands_;
  std::size_t planes_;  // Sums of a voxel.
  double edge_;         // Of a voxel, world units: what lengths are measured by.
  double quantum_;      // Of a sum: this part of an edge.
  double greatest_power_;
  std::vector<Eigen::Vector3i> places_;    // Of the blocks, in steps of a block; in order.
  BrickIndex index_;                       // Which of them is at a place.
  std::vector<std::atomic<Sum*>> blocks_;  // Of each: 8³ sums, plane by plane; null where no light has been.
};

}  // namespace tensorray
