#include "renderer/surfaces/surface.h"

namespace tensorray {

Eigen::Vector3f SurfaceTexture::color_at(const Eigen::Vector3d& point) const {
  const Eigen::Vector2i last = plate.resolution.array() - 1;
  const auto pixel = [&](const Eigen::Vector2i& at) -> const Eigen::Vector3f& {
    const Eigen::Vector2i inside = at.cwiseMax(0).cwiseMin(last);
    return colors[static_cast<std::size_t>(inside.y()) * static_cast<std::size_t>(last.x() + 1) +
                  static_cast<std::size_t>(inside.x())];
  };
  // Far beyond the edges all colours are those of the edge, and integers do not overflow.
  const Eigen::Vector2d at =
      plate.to_pixel(point).cwiseMax(-1.0).cwiseMin(last.cast<double>().array().matrix() + Eigen::Vector2d(2, 2));
  if (!smooth) return pixel(at.array().floor().cast<int>());
  const Eigen::Array2d corner = (at.array() - 0.5).floor();
  const Eigen::Array2f part = (at.array() - 0.5 - corner).cast<float>();
  const Eigen::Vector2i first = corner.cast<int>();
  const auto row = [&](int y) -> Eigen::Vector3f {
    return (1 - part.x()) * pixel(first + Eigen::Vector2i(0, y)) + part.x() * pixel(first + Eigen::Vector2i(1, y));
  };
  return (1 - part.y()) * row(0) + part.y() * row(1);
}

}  // namespace tensorray
