#include "tracing/bending/bending.h"

namespace tensorray {

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

}  // namespace tensorray
