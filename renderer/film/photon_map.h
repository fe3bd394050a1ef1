#pragma once
/// @file renderer/film/photon_map.h
/// The photons that reached the plate, one by one.

#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Single precision: seven digits of world coordinates.
struct Photon {
  Eigen::Vector3f position;   ///< Where it landed, world.
  Eigen::Vector3f direction;  ///< Unit, as it landed.
  Eigen::Vector3f origin;     ///< Where its ray was emitted, world.
  float wavelength = 0;       ///< nm; 0 in RGB mode.
  float power = 0;            ///< In units of the light's irradiance times area.
};

using PhotonMap = std::vector<Photon>;

}  // namespace tensorray
