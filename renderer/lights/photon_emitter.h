#pragma once
/// @file renderer/lights/photon_emitter.h
/// Photons that a directional light or a point sends towards a volume.

#include <vector>

#include <Eigen/Geometry>

#include "renderer/lights/beam.h"
#include "renderer/lights/lights.h"
#include "renderer/sampling/sampling.h"

namespace tensorray {

/// A photon where it starts, before everything that it may meet.
struct EmittedPhoton {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();     ///< World.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Unit.
  double power = 0;  ///< Of all the light towards the volume, for an irradiance (of a point: an intensity) of 1: the
                     ///< mean over N photons of this, f(photon) × power, is the integral of f over the light.
};

/// Immutable: any thread may use it.
class PhotonEmitter {
 public:
  /// @param corners  Of the volume, which is convex.
  /// @param scene    Box about all that parallel light may meet before the volume.
  /// @throw std::invalid_argument if the light is of another kind, or a point within the volume.
  PhotonEmitter(const Light& light, std::vector<Eigen::Vector3d> corners, const Eigen::AlignedBox3d& scene);

  EmittedPhoton sample(PathSampler& sampler) const;

  double power() const;  ///< Mean of EmittedPhoton::power; for a disk, that of its centre.

 private:
  Beam beam_towards(const Eigen::Vector3d& direction) const;

  std::vector<Eigen::Vector3d> corners_;
  Eigen::AlignedBox3d scene_;
  double angle_ = 0;  ///< From the disk's centre to its rim.
  Beam beam_;         ///< Of the disk's centre.
};

}  // namespace tensorray
