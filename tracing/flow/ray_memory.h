#pragma once
/// Keeps the rays of a flow map, for other maps of the same light to other plates.

#include <array>

#include <Eigen/Core>
#include <tbb/concurrent_unordered_map.h>

#include "base/text/content_hash.h"
#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"

namespace tensorray {

/// Remembers where rays leave the volume. All rays must be of the same field, volume, direction and settings; they may
/// differ in where they start and in flexibility. Any number of threads may use it at once.
class RayMemory {
 public:
  /// Whether a ray's exit from the volume says where it lands: rays along `direction` must meet nothing but the plate
  /// of `geometry`, and that only behind the volume.
  static bool serves(const TensorField& field, const Geometry& geometry, const Eigen::Vector3d& direction,
                     const BendingSettings& settings);

  /// Does what trace(field, geometry, settings, batch) does, with the same bits. Rays that it remembers have 0 steps,
  /// and add no tensor samples. `serves` must be true.
  /// @param volume  `geometry` without its plate.
  void trace(const TensorField& field, const Geometry& volume, const Geometry& geometry,
             const BendingSettings& settings, RayBatch& batch);

 private:
  /// A ray that left the volume, or ended in it.
  struct Exit {
    Eigen::Vector3d position, direction;
    double length;
    RayEnd end;
  };
  using Key = std::array<double, 4>;  // Start and flexibility.
  struct Hash {
    std::size_t operator()(const Key& key) const {
      return content_hash({reinterpret_cast<const char*>(key.data()), sizeof key});
    }
  };

  tbb::concurrent_unordered_map<Key, Exit, Hash> exits_;
};

}  // namespace tensorray
