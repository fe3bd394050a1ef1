#pragma once
/// @file integrators/lens/lens_obstacles.h
/// Draws the obstacles of a scene behind the picture of a lens.

#include <Eigen/Core>

#include "renderer/images/image.h"
#include "tracing/bending/geometry.h"

namespace tensorray {

/// What the viewer of a lens sees of obstacles: straight along its lines of sight, by light that comes from the viewer.
class LensObstacles {
 public:
  /// @param surfaces   Its obstacles are drawn.
  /// @param receiver   As the viewer sees it.
  /// @param direction  Of the image's light, unit.
  /// @throw std::runtime_error if Embree fails.
  LensObstacles(const Surfaces& surfaces, const Plate& receiver, const Eigen::Vector3d& direction);

  /// Adds the obstacles between the receiver and the plane of the image to a picture with the receiver's resolution,
  /// where its alpha is less than 1. Its first channels are R, G and B, multiplied by alpha, and A.
  /// @param samples  Samples of a pixel along x and along y.
  void draw(const Plate& plane, int samples, Image& image) const;

 private:
  Eigen::Vector2d see(const Plate& plane, const Eigen::Vector2d& pixel) const;

  Geometry geometry_;
  Plate receiver_;
  Eigen::Vector3d direction_;
};

}  // namespace tensorray
