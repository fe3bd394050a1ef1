#include "renderer/shading/landed_light.h"

#include <cmath>

namespace tensorray {

bool is_lit(const LandedLight& light, const Eigen::Vector3d& point, const Eigen::Vector3d& ray) {
  if (!light.body) return (light.plate.normal().dot(ray) < 0) == (light.side > 0);
  const double off = 1e-4 * light.body->bounds().diagonal().norm();
  return !light.body->occluded(point + off * light.towards, light.towards);
}

void add_irradiance(const LandedLight& light, const Eigen::Vector3d& point, Eigen::ArrayXd& sum) {
  const Eigen::Vector2d at = light.plate.to_pixel(point) - Eigen::Vector2d(0.5, 0.5);
  const Eigen::Vector2i& size = light.plate.resolution;
  if (!((at.array() > -1).all() && (at.array() < size.cast<double>().array()).all())) return;
  const Eigen::Vector2d corner = at.array().floor(), part = at - corner;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 2; ++i) {
      const int x = static_cast<int>(corner.x()) + i, y = static_cast<int>(corner.y()) + j;
      const double weight = (i == 1 ? part.x() : 1 - part.x()) * (j == 1 ? part.y() : 1 - part.y());
      if (!(weight > 0) || x < 0 || y < 0 || x >= size.x() || y >= size.y()) continue;
      const std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x()) + x;
      sum += weight * Eigen::Map<const Eigen::ArrayXf>(&light.irradiance[pixel * static_cast<std::size_t>(light.bands)],
                                                       light.bands)
                          .cast<double>();
    }
}

}  // namespace tensorray
