#pragma once
/// @file renderer/light_maps/irradiance_map.h
/// Light that reaches a surface on bent ways, computed beforehand.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "renderer/surfaces/plate.h"
#include "renderer/surfaces/surface_scene.h"

namespace tensorray {

/// The irradiance of one side of a flat surface, or of the points of a body that straight light would reach if it met
/// nothing else. A surface scatters it as if it arrived straight from the light, which is exact for diffuse materials.
struct IrradianceMap {
  std::uint32_t surface = 0;  ///< Index of the surface.
  int light = -1;             ///< Index of the light that it comes from.
  Plate plate;  ///< The part of the surface that has this light; elsewhere there is none. Of a body: a plane across the
                ///< light, on which its points are projected.
  std::shared_ptr<const SurfaceScene> body;  ///< The surface alone, if it is not flat.
  double side = 1;                           ///< 1: the side of the plate's normal is lit; −1: the other side.
  std::optional<Eigen::Vector3d> source;     ///< Of a point light: where it is.
  Eigen::Vector3d towards = Eigen::Vector3d::UnitZ();  ///< Unit; from the surface to a distant light, on the lit side.
  Eigen::Index bands = 0;
  std::vector<float> irradiance;  ///< On `plate`, in every band, pixel after pixel.
  std::vector<float> folds;       ///< On `plate`: the number of sheets of light that lie on each other.
};

/// Light that grazes a plate straight may come from above it when it is bent: it counts as if it came from above.
constexpr double grazing_cosine = 0.05;

/// Unit; from a point of the surface to the light.
Eigen::Vector3d direction_towards(const IrradianceMap& light, const Eigen::Vector3d& point);

/// Whether a point of the surface may have this light. @param ray  Direction of the ray that found the point.
bool is_lit(const IrradianceMap& light, const Eigen::Vector3d& point, const Eigen::Vector3d& ray);

/// The number of sheets at a point of the surface; 0 where there is no light.
float folds_at(const IrradianceMap& light, const Eigen::Vector3d& point);

/// Adds the irradiance of the plate at a point of the surface to `sum`, with linear interpolation between pixels; up to
/// the plate's edge, its outermost pixels go on. On a body it is that of a surface that faces the light.
/// @param sum  Of the bands from `first_band` on.
void add_irradiance(const IrradianceMap& light, const Eigen::Vector3d& point, Eigen::ArrayXd& sum,
                    Eigen::Index first_band = 0);

}  // namespace tensorray
