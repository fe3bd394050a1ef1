#include "tracing/bending/ray_record.h"

#include <cmath>

namespace tensorray {

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

void RayRecord::clear() {
  before.clear();
  steps.clear();
  behind.clear();
}

}  // namespace tensorray
