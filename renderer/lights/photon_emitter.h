#pragma once
/// Photons that a directional light, a point or an area light sends towards a volume, or within it.

#include <optional>
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
  /// Of all the light towards the volume, for an irradiance (of a point: an intensity; of an area: a radiance) of 1:
  /// the mean over N photons of f(photon) × power is the integral of f over the light.
  double power = 0;
  double density = 0;  ///< Of an area light: `PhotonEmitter::density`.
};

/// Immutable: any thread may use it.
class PhotonEmitter {
 public:
  /// @param corners  Of the volume, which is convex.
  /// @param scene    Box about all that parallel light may meet before the volume.
  /// @throw std::invalid_argument if the light is of another kind.
  PhotonEmitter(const Light& light, std::vector<Eigen::Vector3d> corners, const Eigen::AlignedBox3d& scene);

  EmittedPhoton sample(PathSampler& sampler) const;

  double power() const;  ///< Mean of EmittedPhoton::power; for a disk, that of its centre; for an area, about.

  /// Of an area light: the density with which `sample` starts at a place of the light, in a direction towards the
  /// volume; per area and per solid angle times the cosine at the light. Zero on the side that does not emit.
  /// @param normal  Unit; of the light at `position`.
  double density(const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                 const Eigen::Vector3d& direction) const;

 private:
  /// An area light, and the ball about the volume.
  struct Lamp {
    TriangleMesh mesh;
    Distribution1D triangles;  ///< By area.
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    double radius = 0;

    /// Whether a place is within the ball: it sends light everywhere.
    bool is_within(const Eigen::Vector3d& position) const { return (center - position).norm() <= radius; }

    /// From a place outside of the ball: the angle between its middle and its rim.
    double angle(const Eigen::Vector3d& position) const;
  };
  static Lamp make_lamp(const AreaLight& light, const std::vector<Eigen::Vector3d>& corners);

  EmittedPhoton sample_sun(PathSampler& sampler) const;
  EmittedPhoton sample_beam(PathSampler& sampler) const;
  EmittedPhoton sample_lamp(PathSampler& sampler) const;
  Beam beam_towards(const Eigen::Vector3d& direction) const;

  std::vector<Eigen::Vector3d> corners_;
  Eigen::AlignedBox3d scene_;
  double angle_ = 0;  ///< From the disk's centre to its rim.
  Beam beam_;         ///< Of the disk's centre, or of a point that the volume does not surround.
  std::optional<Eigen::Vector3d> surrounded_;  ///< A point that it does.
  std::optional<Lamp> lamp_;
};

}  // namespace tensorray
