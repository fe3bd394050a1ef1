#pragma once
/// @file integrators/flow/ray_memory.h
/// Rays that were traced for one flow map, kept for others of the same light whose plates differ.

#include <array>
#include <cstddef>

#include <Eigen/Core>
#include <tbb/concurrent_unordered_map.h>

#include "integrators/bending/bending.h"

namespace tensorray {

/// Remembers where rays leave the volume. All rays must be of the same field, volume, direction and settings; they may
/// differ in where they start and in flexibility. Any number of threads may use it at once.
class RayMemory {
 public:
  /// Whether rays along `direction` meet the plate of `geometry` only behind the volume, and nothing else, so that
  /// where they leave the volume says where they land.
  static bool serves(const TensorField& field, const Geometry& geometry, const Eigen::Vector3d& direction,
                     const BendingSettings& settings);

  /// The same as trace(field, geometry, settings, batch), bit for bit, but that it counts only the samples of rays that
  /// it does not remember. @param volume  `geometry` without its plate; `serves` must hold.
  void trace(const TensorField& field, const Geometry& volume, const Geometry& geometry,
             const BendingSettings& settings, RayBatch& batch);

  std::size_t size() const { return exits_.size(); }

 private:
  /// A ray that left the volume, or ended in it.
  struct Exit {
    Eigen::Vector3d position, direction;
    double length;
    RayEnd end;
  };
  using Key = std::array<double, 4>;  // Start and flexibility.

  struct Hash {
    std::size_t operator()(const Key& key) const;
  };

  static Key key_of(const RayBatch& batch, std::size_t ray);

  tbb::concurrent_unordered_map<Key, Exit, Hash> exits_;
};

/// `geometry` without its plate.
Geometry without_plate(const Geometry& geometry);

}  // namespace tensorray
