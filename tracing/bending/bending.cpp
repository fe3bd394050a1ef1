#include "tracing/bending/bending.h"

#include <algorithm>

namespace tensorray {
namespace {

// Cosine: about 45°, so that faces at 45° are no side faces whatever rounding does.
constexpr double along_light = 1e-9;
constexpr double at_face = 1e-5;  // In sizes of the box: a ray that ends so near to the face has left.

}  // namespace

BendingSettings resolved(BendingSettings settings, const TensorField& field) {
  if (settings.method == BendingMethod::automatic)
    settings.method = field.is_cubic() ? BendingMethod::splitting4 : BendingMethod::splitting;
  return settings;
}

const char* to_string(RayEnd end) {
  constexpr const char* names[ray_end_count] = {"plate", "missed", "obstacle", "step_limit", "degenerate", "side"};
  return names[static_cast<int>(end)];
}

void RayBatch::clear() {
  position.clear();
  direction.clear();
  flexibility.clear();
  differentials.clear();
  end.clear();
  length.clear();
  steps.clear();
}

void RayBatch::add(const Eigen::Vector3d& from, const Eigen::Vector3d& along, double s) {
  position.push_back(from);
  direction.push_back(along);
  flexibility.push_back(s);
}

PathPoint path_point(const TensorField& field, const StepPoint& step, double entry_length) {
  PathPoint point;
  point.position = field.to_world() * index_position(step.place());
  point.direction = Eigen::Map<const Eigen::Vector3f>(step.direction).cast<double>().normalized();
  point.length = entry_length + double{step.length};
  point.in_field = true;
  return point;
}

PathPoint path_point(const TensorField& field, const RayRecord& record, std::size_t i) {
  if (i < record.before.size()) return record.before[i];
  i -= record.before.size();
  return i < record.steps.size() ? path_point(field, record.steps[i], record.before.back().length)
                                 : record.behind[i - record.steps.size()];
}

SideFaces::SideFaces(const TensorField& field, const Eigen::Vector3d& direction) : field_(field) {
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d normal = field.to_index().linear().row(axis).normalized();
    const double cosine = normal.dot(direction.normalized());
    is_side_[2 * axis] = -cosine < along_light;
    is_side_[2 * axis + 1] = cosine < along_light;
  }
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
