#pragma once
/// @file integrators/lens/lens_map.h
/// Parallel light from one plane to another through a tensor field: where it lands, and how that changes across it.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "integrators/bending/bending.h"

namespace tensorray {

/// Where one ray landed. Coordinates in a plane are along its plate's right and up, from its centre, world units.
struct LensLanding {
  RayEnd end = RayEnd::missed;                             ///< `plate`: it landed.
  Eigen::Vector2d at = Eigen::Vector2d::Zero();            ///< If it landed.
  Eigen::Matrix2d jacobian = Eigen::Matrix2d::Identity();  ///< Of `at` by the start; if it landed.
  double length = 0;                                       ///< Of the way, world units.
};

/// What tracing took.
struct TraceCounts {
  std::uint64_t ray_steps = 0, tensor_samples = 0;

  TraceCounts& operator+=(const TraceCounts& more) {
    ray_steps += more.ray_steps;
    tensor_samples += more.tensor_samples;
    return *this;
  }
};

/// A map from the plane of `from` to that of `to`, a function of the start and the flexibility. Light beyond both
/// planes is not followed: they stand for an image and a receiver, both opaque, and cut the volume where they are
/// within it. Both planes reach farther than their plates: to 100 times the volume's size. Immutable; any number of
/// threads may trace at once.
class LensMap {
 public:
  /// @param surfaces   Bounds, cut and obstacles; its plate plays no part.
  /// @param direction  Of the light, unit, from one plane to the other.
  /// `field` must outlive the map.
  /// @throw std::runtime_error if Embree fails.
  LensMap(const TensorField& field, const Surfaces& surfaces, const BendingSettings& bending, const Plate& from,
          const Plate& to, const Eigen::Vector3d& direction);

  const Plate& from() const { return from_; }
  const Plate& to() const { return to_; }

  /// Follows a ray for each of `starts` and each of `flexibilities`, those of one start next to each other, and writes
  /// starts.size() · flexibilities.size() landings. @return what it took.
  TraceCounts trace(const std::vector<Eigen::Vector2d>& starts, const std::vector<double>& flexibilities,
                    LensLanding* landings) const;

 private:
  const TensorField* field_;
  BendingSettings bending_;
  Plate from_, to_;
  Eigen::Vector3d direction_;
  Geometry geometry_;
};

/// The point of a plate's plane with the given coordinates, and the other way round.
Eigen::Vector3d plane_point(const Plate& plate, const Eigen::Vector2d& at);
Eigen::Vector2d plane_coordinates(const Plate& plate, const Eigen::Vector3d& point);

}  // namespace tensorray
