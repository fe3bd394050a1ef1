#include "renderer/light_maps/irradiance_map.h"

#include <cmath>

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr double rounding = 1e-3;  // Pixels by which a point of the surface may lie beside its plate.

/// The place of a point of the surface on the plate.
Vector3d place_of(const IrradianceMap& light, const Vector3d& point) {
  if (!light.body || !light.source) return point;  // Pixels are those of the point's projection along the normal.
  return projected_from(*light.source, light.plate, point);
}

}  // namespace

Vector3d direction_towards(const IrradianceMap& light, const Vector3d& point) {
  if (!light.source) return light.towards;
  const Vector3d towards = (*light.source - point).normalized(), normal = light.side * light.plate.normal();
  return light.body || towards.dot(normal) > grazing_cosine ? towards : normal;
}

bool is_lit(const IrradianceMap& light, const Vector3d& point, const Vector3d& ray) {
  if (!light.body) return (light.plate.normal().dot(ray) < 0) == (light.side > 0);
  const double off = 1e-4 * light.body->bounds().diagonal().norm();
  const Vector3d towards = direction_towards(light, point);
  return !light.body->occluded(point + off * towards, towards);
}

void add_irradiance(const IrradianceMap& light, const Vector3d& point, Eigen::ArrayXd& sum, Eigen::Index first_band) {
  const Vector3d place = place_of(light, point);
  const Eigen::Array2d at = light.plate.to_pixel(place), size = light.plate.resolution.cast<double>();
  if (!((at > -rounding).all() && (at < size + rounding).all())) return;
  // Beyond the centres of the outermost pixels, these alone count.
  const Eigen::Array2d between = (at - 0.5).max(0).min(size - 1), corner = between.floor(), part = between - corner;
  double radiance_scale = 1;
  if (light.body && light.source) {  // From the plate to a surface at the point that faces the light.
    const Vector3d to_plate = place - *light.source;
    const double cosine = std::abs(light.plate.normal().dot(to_plate)) / to_plate.norm();
    radiance_scale = to_plate.squaredNorm() / ((point - *light.source).squaredNorm() * cosine);
  }
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 2; ++i) {
      const int x = static_cast<int>(corner.x()) + i, y = static_cast<int>(corner.y()) + j;
      const double weight = (i == 1 ? part.x() : 1 - part.x()) * (j == 1 ? part.y() : 1 - part.y());
      if (!(weight > 0)) continue;
      const Eigen::Index pixel = static_cast<Eigen::Index>(y) * light.plate.resolution.x() + x;
      const float* const irradiance = light.irradiance.data() + pixel * light.bands + first_band;
      sum += radiance_scale * weight * Eigen::Map<const Eigen::ArrayXf>(irradiance, sum.size()).cast<double>();
    }
}

float folds_at(const IrradianceMap& light, const Vector3d& point) {
  const Eigen::Vector2d at = light.plate.to_pixel(place_of(light, point));
  const Eigen::Vector2i& size = light.plate.resolution;
  if (!((at.array() >= 0).all() && (at.array() < size.cast<double>().array()).all())) return 0;
  const auto pixel =
      static_cast<std::size_t>(at.y()) * static_cast<std::size_t>(size.x()) + static_cast<std::size_t>(at.x());
  return pixel < light.folds.size() ? light.folds[pixel] : 0;
}

}  // namespace tensorray
