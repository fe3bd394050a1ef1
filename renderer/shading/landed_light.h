#pragma once
/// @file renderer/shading/landed_light.h
/// Light that reaches a surface on bent ways, computed beforehand.

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "renderer/surfaces/plate.h"
#include "renderer/surfaces/surface_scene.h"

namespace tensorray {

/// The irradiance of one side of a flat surface, or of the points of a body that straight light would reach if it met
/// nothing else. A surface scatters it as if it all arrived along one direction, which is exact for diffuse materials.
struct LandedLight {
  std::uint32_t surface = 0;  ///< Index of the surface.
  Plate plate;  ///< The part of the surface that has this light; elsewhere there is none. Of a body: a plane across the
                ///< light, on which its points are projected.
  std::shared_ptr<const SurfaceScene> body;  ///< The surface alone, if it is not flat.
  double side = 1;                           ///< 1: the side of the plate's normal is lit; −1: the other side.
  Eigen::Vector3d towards = Eigen::Vector3d::UnitZ();  ///< Unit; from the surface to the light, on the lit side.
  Eigen::Index bands = 0;
  std::vector<float> irradiance;  ///< On `plate`, in every band, pixel after pixel.
};

/// Whether a point of the surface may have this light. @param ray  Direction of the ray that found the point.
bool is_lit(const LandedLight& light, const Eigen::Vector3d& point, const Eigen::Vector3d& ray);

/// Adds the irradiance of the plate at a point of the surface to `sum`, with linear interpolation between pixels.
void add_irradiance(const LandedLight& light, const Eigen::Vector3d& point, Eigen::ArrayXd& sum);

}  // namespace tensorray
