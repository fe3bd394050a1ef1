#include "renderer/surfaces/plate.h"

namespace tensorray {

Eigen::Vector3d upright(const Eigen::Vector3d& direction, const Eigen::Vector3d& up) {
  const Eigen::Vector3d along = direction.normalized();
  const auto across = [&](const Eigen::Vector3d& axis) -> Eigen::Vector3d { return axis - axis.dot(along) * along; };
  if (across(up).norm() > 1e-6 * up.norm()) return across(up).normalized();
  if (across(Eigen::Vector3d::UnitZ()).norm() > 1e-6) return across(Eigen::Vector3d::UnitZ()).normalized();
  return across(Eigen::Vector3d::UnitY()).normalized();
}

Eigen::Vector3d projected_from(const Eigen::Vector3d& source, const Plate& plate, const Eigen::Vector3d& point) {
  const Eigen::Vector3d normal = plate.normal(), way = point - source;
  return source + normal.dot(plate.center - source) / normal.dot(way) * way;
}

}  // namespace tensorray
