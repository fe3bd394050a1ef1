#pragma once
/// The plate (scene key: receiver): a rectangle that collects light.

#include <vector>

#include <Eigen/Geometry>

namespace tensorray {

/// A rectangle in world space, divided into pixels. Pixel (0, 0) is the top left one as seen along `-normal`. Pixel
/// coordinates are continuous: pixel (x, y) covers [x, x+1) × [y, y+1).
struct Plate {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();  ///< Unit; x increases along it.
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();     ///< Unit, normal to `right`; y decreases along it.
  Eigen::Vector2d size{1, 1};                        ///< Along `right` and `up`, world units; > 0.
  Eigen::Vector2i resolution{512, 512};              ///< Pixels; > 0.

  Eigen::Vector3d normal() const { return right.cross(up); }  ///< Unit, towards the viewer.
  Eigen::Vector2d pixel_size() const { return size.cwiseQuotient(resolution.cast<double>()); }
  double pixel_area() const { return pixel_size().prod(); }

  std::vector<Eigen::Vector3d> corners() const {
    const Eigen::Vector3d x = size.x() / 2 * right, y = size.y() / 2 * up;
    return {center - x - y, center + x - y, center + x + y, center - x + y};
  }

  Eigen::Vector2d to_pixel(const Eigen::Vector3d& world) const {
    const Eigen::Vector3d p = world - center;
    return {(p.dot(right) / size.x() + 0.5) * resolution.x(), (0.5 - p.dot(up) / size.y()) * resolution.y()};
  }
  Eigen::Vector3d to_world(const Eigen::Vector2d& pixel) const {
    return center + (pixel.x() / resolution.x() - 0.5) * size.x() * right +
           (0.5 - pixel.y() / resolution.y()) * size.y() * up;
  }
};

/// Where the line from `source` through a point meets the plane of the plate.
inline Eigen::Vector3d projected_from(const Eigen::Vector3d& source, const Plate& plate, const Eigen::Vector3d& point) {
  const Eigen::Vector3d normal = plate.normal(), way = point - source;
  return source + normal.dot(plate.center - source) / normal.dot(way) * way;
}

/// A unit vector normal to `direction`: the normalised component of `up` across it. If `up` is parallel to `direction`
/// or zero, +z replaces it, or +y if +z is also parallel.
inline Eigen::Vector3d upright(const Eigen::Vector3d& direction, const Eigen::Vector3d& up) {
  const Eigen::Vector3d along = direction.normalized();
  const auto across = [&](const Eigen::Vector3d& axis) -> Eigen::Vector3d { return axis - axis.dot(along) * along; };
  if (across(up).norm() > 1e-6 * up.norm()) return across(up).normalized();
  if (across(Eigen::Vector3d::UnitZ()).norm() > 1e-6) return across(Eigen::Vector3d::UnitZ()).normalized();
  return across(Eigen::Vector3d::UnitY()).normalized();
}

}  // namespace tensorray
