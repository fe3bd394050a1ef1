#pragma once
/// @file renderer/shading/landed_light.h
/// Light that reaches a flat surface on bent ways, computed beforehand.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "renderer/surfaces/plate.h"

namespace tensorray {

/// The irradiance of one side of a flat surface. A surface scatters it as if it all arrived along one direction, which
/// is exact for diffuse materials.
struct LandedLight {
  std::uint32_t surface = 0;  ///< Index of the surface.
  Plate plate;                ///< The part of the surface that has this light; elsewhere there is none.
  double side = 1;            ///< 1: the side of the plate's normal is lit; −1: the other side.
  Eigen::Vector3d towards = Eigen::Vector3d::UnitZ();  ///< Unit; from the surface to the light, on the lit side.
  Eigen::Index bands = 0;
  std::vector<float> irradiance;  ///< In every band, pixel after pixel of the plate.
};

/// Adds the irradiance at a point of the surface to `sum`, with linear interpolation between pixels.
void add_irradiance(const LandedLight& light, const Eigen::Vector3d& point, Eigen::ArrayXd& sum);

}  // namespace tensorray
