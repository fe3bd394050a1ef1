#include "base/geometry/turn.h"

#include <cmath>

namespace tensorray {

Eigen::Quaterniond turn_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const double cosine = b.dot(a);
  Eigen::Quaterniond turn;
  if (cosine < -1 + 1e-12) {
    turn.vec() = a.unitOrthogonal();
    turn.w() = 0;
    return turn;
  }
  const double twice = std::sqrt((1 + cosine) * 2);  // Twice the cosine of half of the angle.
  turn.vec() = a.cross(b) * (1 / twice);
  turn.w() = twice * 0.5;
  return turn;
}

}  // namespace tensorray
