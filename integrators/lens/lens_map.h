#pragma once
/// @file integrators/lens/lens_map.h
/// Parallel light from one plane to another through a tensor field: where each ray lands, and how the landing changes
/// with the start.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"

namespace tensorray {

/// The landing of one ray. Coordinates in a plane are along its plate's right and up, from its centre, world units.
struct LensLanding {
  RayEnd end = RayEnd::missed;                             ///< `plate`: the ray landed.
  Eigen::Vector2d at = Eigen::Vector2d::Zero();            ///< Coordinates of the landing, if the ray landed.
  Eigen::Matrix2d jacobian = Eigen::Matrix2d::Identity();  ///< ∂at/∂start, if the ray landed.
  double length = 0;                                       ///< Length of the ray, world units.
};

/// Cost of tracing.
struct TraceCounts {
  std::uint64_t ray_steps = 0, tensor_samples = 0;

  TraceCounts& operator+=(const TraceCounts& more) {
    ray_steps += more.ray_steps;
    tensor_samples += more.tensor_samples;
    return *this;
  }
};

/// A map from the plane of `from` to the plane of `to`; a function of the start and the flexibility. The planes stand
/// for an image and a receiver. Both are opaque: light is not followed beyond them, and a plane within the volume cuts
/// it. Both planes extend beyond their plates, to 100 times the volume's size. Immutable; any number of threads may
/// trace at once.
class LensMap {
 public:
  /// @param surfaces   Bounds, cut and obstacles; its plate is not used.
  /// @param direction  Direction of the light, unit, from one plane to the other.
  /// `field` must outlive the map.
  /// @throw std::runtime_error if Embree fails.
  LensMap(const TensorField& field, const Surfaces& surfaces, const BendingSettings& bending, const Plate& from,
          const Plate& to, const Eigen::Vector3d& direction);

  /// The scene whose plate is the plane where light lands.
  const Geometry& geometry() const { return geometry_; }

  /// Follows a ray for each of `starts` and each of `flexibilities` and writes starts.size() · flexibilities.size()
  /// landings. The landings of one start are next to each other. @return the cost.
  TraceCounts trace(const std::vector<Eigen::Vector2d>& starts, const std::vector<double>& flexibilities,
                    LensLanding* landings) const;

 private:
  const TensorField* field_;
  BendingSettings bending_;
  Plate from_, to_;
  Eigen::Vector3d direction_;
  Geometry geometry_;
};

/// The world point with the given coordinates in a plate's plane, and the inverse.
Eigen::Vector3d plane_point(const Plate& plate, const Eigen::Vector2d& at);
Eigen::Vector2d plane_coordinates(const Plate& plate, const Eigen::Vector3d& point);

}  // namespace tensorray
