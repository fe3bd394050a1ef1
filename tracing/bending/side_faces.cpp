#include "tracing/bending/side_faces.h"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace tensorray {
namespace {

constexpr double along_light =
    0.7;                          // Cosine: about 45°, so that faces at 45° are no side faces whatever rounding does.
constexpr double at_face = 1e-5;  // In sizes of the box: a ray that ends so near to the face has left.

}  // namespace

SideFaces::SideFaces(const TensorField& field, const Eigen::Vector3d& direction) : field_(field) {
  std::array<double, 6> cosines{};
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d normal = field.to_index().linear().row(axis).normalized();
    cosines[2 * axis + 1] = normal.dot(direction.normalized());
    cosines[2 * axis] = -cosines[2 * axis + 1];
  }
  const bool is_oblique = *std::max_element(cosines.begin(), cosines.end()) < along_light;
  for (std::size_t face = 0; face < cosines.size(); ++face)
    is_side_[face] = cosines[face] < along_light && !(is_oblique && cosines[face] > 0);
}

/// @param position, direction  Of the straight end of a ray.
bool SideFaces::left_through(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const {
  const Eigen::Array3d at = field_.to_index() * position, along = field_.to_index().linear() * direction;
  const Eigen::AlignedBox3d& box = field_.index_bounds();
  double entry = -std::numeric_limits<double>::infinity(), exit = -entry;  // Distances along the ray, world units.
  int face = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (along[axis] == 0) {
      if (at[axis] < box.min()[axis] || at[axis] > box.max()[axis]) return false;
      continue;
    }
    const bool is_upwards = along[axis] > 0;
    const double low = (box.min()[axis] - at[axis]) / along[axis], high = (box.max()[axis] - at[axis]) / along[axis];
    entry = std::max(entry, is_upwards ? low : high);
    const double out = is_upwards ? high : low;
    if (out >= exit) continue;
    exit = out;
    face = 2 * axis + (is_upwards ? 1 : 0);
  }
  const double size = (field_.to_world().linear() * box.sizes()).norm();
  return entry < exit && exit < at_face * size && is_side_[face];
}

void SideFaces::mark(RayBatch& batch) const {
  for (std::size_t i = 0; i < batch.size(); ++i) {
    RayEnd& end = batch.end[i];
    if ((end == RayEnd::plate || end == RayEnd::missed) && left_through(batch.position[i], batch.direction[i]))
      end = RayEnd::side;
  }
}

}  // namespace tensorray
