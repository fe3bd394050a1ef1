#include "integrators/packets/packet_medium.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "integrators/steps/exponential.h"

namespace tensorray::packets {

PacketMedium::PacketMedium(const TensorField& field_, const KernelSettings& settings_)
    : field(field_), settings(settings_) {
  const Eigen::Matrix3d M = field.to_index().linear();
  const bool cubes = M == Eigen::Matrix3d(M(0, 0) * Eigen::Matrix3d::Identity()) && M(0, 0) > 0;
  uniform = cubes && settings.method == BendingMethod::splitting && !field.is_cubic();
  voxel = static_cast<float>(1 / M(0, 0));
  const Eigen::Matrix3d to_world = field.to_world().linear();
  unit = static_cast<float>(std::exp2(std::round(std::log2(to_world.col(0).norm()))));
  longest_voxel = static_cast<float>(to_world.norm());  // The norm is not less than the greatest singular value.
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) to_index[row][column] = static_cast<float>(M(row, column));
  for (int axis = 0; axis < 3; ++axis) {
    first[axis] = static_cast<std::int32_t>(field.voxels().min()[axis]);
    last[axis] = static_cast<std::int32_t>(field.voxels().max()[axis]);
    slope[axis] = field.voxels().sizes()[axis] > 0 ? 1.0f : 0.0f;
    margin[axis] = static_cast<float>(field.index_bounds().max()[axis] - field.voxels().max()[axis]);
  }
  flat = (field.voxels().sizes().array() == 0).any();
  stages = runge_kutta(settings.method);
  composed = settings.method == BendingMethod::splitting4;
  adaptive = is_adaptive(settings.method, double{settings.step});
  clamps = flat || settings.method != BendingMethod::splitting || field.is_cubic();
  const double automatic = composed   ? step_lengths::longest_composed
                           : adaptive ? step_lengths::longest_adaptive
                                      : step_lengths::longest_automatic;
  longest_step = settings.step > 0 ? settings.step : static_cast<float>(automatic);
  longest_kick = longest_step;
  if (composed) longest_kick *= static_cast<float>(splitting4_method.kick[Composition::kicks / 2]);
  past_straight_brick =
      static_cast<float>(stages ? step_lengths::past_straight_brick_by_stages : step_lengths::past_straight_brick);
  // A step may begin a little outside its brick.
  const double margin_of_steps = std::min(longest_step + 1.0, 1e9);
  for (int axis = 0; axis < 3; ++axis) {
    first_inner[axis] = static_cast<std::int32_t>(std::ceil((first[axis] + margin_of_steps) / TensorBrick::cells));
    last_inner[axis] = static_cast<std::int32_t>(std::floor((last[axis] - margin_of_steps) / TensorBrick::cells)) - 1;
    if (clamps) first_inner[axis] = last_inner[axis] + 1;
  }
  find_bricks_near_surfaces(margin_of_steps);
  bounded = std::isfinite(settings.max_length);
}

void PacketMedium::find_bricks_near_surfaces(double margin_of_steps) {
  constexpr double cells = TensorBrick::cells, most = 1e8;
  for (int axis = 0; axis < 3; ++axis) {
    first_near[axis] = 1;
    last_near[axis] = 0;
    if (!settings.meets_surface) continue;
    const double low = settings.surfaces.min()[axis] - margin_of_steps - cells;
    const double high = settings.surfaces.max()[axis] + margin_of_steps;
    first_near[axis] = static_cast<std::int32_t>(std::clamp(std::ceil(low / cells), -most, most));
    last_near[axis] = static_cast<std::int32_t>(std::clamp(std::floor(high / cells), -most, most));
  }
}

bool PacketMedium::meets_surface(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  return settings.meets_surface(field.to_world() * from, field.to_world() * to);
}

float strong_log_radiance_scale(const float T[9], float factor, const float v[3]) {
  const Eigen::Matrix3d A = double{factor} * Eigen::Map<const Eigen::Matrix3f>(T).cast<double>();
  const Eigen::Vector3d direction = Eigen::Map<const Eigen::Vector3f>(v).cast<double>();
  return static_cast<float>(-3 * exponential_direction(A, direction).log_length);
}

}  // namespace tensorray::packets
