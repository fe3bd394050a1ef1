#include "integrators/packet_tracer.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "integrators/packet_kernel.h"
#include "integrators/scalar_tracer.h"

namespace tensorray {
namespace {

using packets::KernelRay;
using packets::KernelSettings;

constexpr double surface_margin = 4e-6;  // In sizes of the volume; more than Geometry's own.

/// Surfaces that rays may meet within the field, in index space; empty if there are none.
Eigen::AlignedBox3d surfaces_within(const TensorField& field, const Geometry& geometry) {
  if (geometry.has_cut()) return field.index_bounds();
  Eigen::AlignedBox3d volume = geometry.surfaces().bounds.bounds();
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(surface_margin * volume.diagonal().norm());
  volume = Eigen::AlignedBox3d(volume.min() - margin, volume.max() + margin);
  const Eigen::AlignedBox3d world = geometry.absorbers_within(volume);
  Eigen::AlignedBox3d index;
  if (world.isEmpty()) return index;
  for (int i = 0; i < 8; ++i)
    index.extend(field.to_index() * world.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)));
  return index;
}

/// Whether the step from one point to another is one that only the reference takes.
bool meets_surface(const Geometry& geometry, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const bool may_absorb = geometry.may_absorb(from, to);
  if (!may_absorb && !geometry.has_cut()) return false;
  const double length = (to - from).norm();
  if (!(length > 0)) return true;
  const Eigen::Vector3d along = (to - from) / length;
  return (geometry.has_cut() && geometry.crossing(Surface::cut, false, from, along, length)) ||
         (may_absorb && geometry.absorber(from, along, length));
}

KernelSettings kernel_settings(const TensorField& field, const Geometry& geometry, const BendingSettings& settings) {
  KernelSettings result;
  result.method = settings.method;
  result.step = static_cast<float>(settings.step);
  result.max_steps = static_cast<std::uint32_t>(settings.max_steps);
  result.max_length = static_cast<float>(settings.max_length);
  result.surfaces = surfaces_within(field, geometry);
  if (!result.surfaces.isEmpty())
    result.meets_surface = [&geometry](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
      return meets_surface(geometry, from, to);
    };
  return result;
}

/// A ray where its way begins to bend, but for its flexibility.
KernelRay kernel_ray(const TensorField& field, Tracer<1>& tracer) {
  KernelRay ray;
  const Eigen::Vector3d index = field.to_index() * Eigen::Vector3d(tracer.state().P);
  for (int axis = 0; axis < 3; ++axis) {
    const double first = field.voxels().min()[axis], last = std::max(first, field.voxels().max()[axis] - 1);
    const double cell = std::clamp(std::floor(index[axis]), first, last);
    ray.brick[axis] = static_cast<std::int32_t>(std::floor(cell / TensorBrick::cells));
    ray.position[axis] = static_cast<float>(index[axis] - TensorBrick::cells * ray.brick[axis]);
    ray.direction[axis] = static_cast<float>(tracer.state().V(axis));
  }
  ray.norm = static_cast<float>(tracer.strength());
  ray.length = tracer.length();
  ray.steps = tracer.steps();
  return ray;
}

State<1> state_of(const TensorField& field, const KernelRay& ray) {
  Eigen::Vector3d index;
  State<1> state;
  for (int axis = 0; axis < 3; ++axis) {
    index[axis] = TensorBrick::cells * double{1} * ray.brick[axis] + ray.position[axis];
    state.V(axis) = ray.direction[axis];
  }
  if (ray.axis >= 0) {
    const Eigen::AlignedBox3d& box = field.index_bounds();
    const int axis = ray.axis;
    index[axis] = index[axis] > box.center()[axis] ? box.max()[axis] : box.min()[axis];
  }
  state.P = field.to_world() * index;
  return bending_steps::normalized(state);
}

void set_end(RayBatch& batch, std::size_t i, RayEnd end, const Tracer<1>& tracer) {
  batch.end[i] = end;
  batch.position[i] = tracer.state().P;
  batch.direction[i] = tracer.state().V;
  batch.length[i] = tracer.length();
  batch.steps[i] = tracer.steps();
}

bool same_start(const RayBatch& batch, std::size_t i, std::size_t j) {
  return batch.position[i] == batch.position[j] && batch.direction[i] == batch.direction[j];
}

/// The rays of the batch that come to where light bends, and which ones they are. The others end here.
void approach(const TensorField& field, RayBatch& batch, Tracer<1>& tracer, std::vector<KernelRay>& rays,
              std::vector<std::size_t>& numbers) {
  for (std::size_t i = 0; i < batch.size();) {
    const std::size_t first = i;
    const auto end = tracer.approach({batch.position[i], batch.direction[i]}, Recording());
    const KernelRay ray = end ? KernelRay() : kernel_ray(field, tracer);
    std::size_t last = first + 1;
    while (last < batch.size() && same_start(batch, last, first)) ++last;
    for (; i < last; ++i) {
      if (end || !std::isfinite(batch.flexibility[i])) {
        set_end(batch, i, std::isfinite(batch.flexibility[i]) ? *end : RayEnd::degenerate, tracer);
        continue;
      }
      rays.push_back(ray);
      rays.back().flexibility = static_cast<float>(batch.flexibility[i]);
      numbers.push_back(i);
    }
  }
}

}  // namespace

bool trace_in_packets(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                      RayBatch& batch) {
  if (!packets::has_kernel(settings.method) || !batch.differentials.empty()) return false;
  thread_local std::vector<KernelRay> rays;
  thread_local std::vector<std::size_t> numbers;
  rays.clear();
  numbers.clear();
  Tracer<1> tracer(field, geometry, settings);
  approach(field, batch, tracer, rays, numbers);
  batch.tensor_samples += packets::run(field, kernel_settings(field, geometry, settings), rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const KernelRay& ray = rays[i];
    const State<1> state = state_of(field, ray);
    const double s = batch.flexibility[numbers[i]];
    const RayEnd end = ray.axis >= 0 ? tracer.take_over_leaving(state, ray.length, ray.steps)
                                     : tracer.take_over(state, s, ray.length, ray.steps, double{ray.step});
    set_end(batch, numbers[i], end, tracer);
  }
  batch.tensor_samples += tracer.samples();
  return true;
}

}  // namespace tensorray
