#pragma once
/// @file renderer/film/plate_photon.h
/// The photons that reached the plate, as a list.

#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// A photon where it reached the plate. Single precision: seven digits of world coordinates.
struct PlatePhoton {
  Eigen::Vector3f position;   ///< Landing, world.
  Eigen::Vector3f direction;  ///< Unit direction at the landing, world.
  Eigen::Vector3f origin;     ///< Where the ray was emitted, world.
  float wavelength = 0;       ///< nm; 0 in RGB mode.
  float power = 0;            ///< In units of the irradiance of the light times area.
};

}  // namespace tensorray
