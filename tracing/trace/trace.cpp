#include "tracing/trace/trace.h"

#include <cmath>
#include <stdexcept>
#include <string_view>

#include <Eigen/Geometry>

#include "base/geometry/box.h"
#include "base/text/content_hash.h"
#include "tracing/kernels/packet_kernel.h"
#include "tracing/steps/scalar_tracer.h"

// Rays are traced in packets (packet_kernel.h) inside the field. The scalar tracer (scalar_tracer.h) does the rest, ray
// by ray: the way to the field and behind it, steps that are too short for single precision, and the last step of rays
// with differentials. Rays that leave the cut and enter it again are then traced in packets again. Where packets cannot
// trace a batch, the scalar tracer does all.

namespace tensorray {
namespace {

using packets::KernelRay;
using packets::KernelSettings;

constexpr double face_margin = 1e-3;     // Voxels; above the error of single precision.
constexpr double min_tolerance = 1e-5;   // Of automatic steps; below it, errors of single precision would show.
constexpr double surface_margin = 4e-6;  // In sizes of the volume; above the margin of Geometry.

/// A box around the surfaces that rays may meet within the field, in index space; empty if there are none.
Eigen::AlignedBox3d surfaces_within(const TensorField& field, const Geometry& geometry) {
  if (geometry.has_cut()) return field.index_bounds();
  Eigen::AlignedBox3d volume = geometry.surfaces().bounds.bounds();
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(surface_margin * volume.diagonal().norm());
  volume = Eigen::AlignedBox3d(volume.min() - margin, volume.max() + margin);
  const Eigen::AlignedBox3d world = geometry.absorbers_within(volume);
  return world.isEmpty() ? world : box_of(corners_of(world, field.to_index()));
}

KernelSettings kernel_settings(const TensorField& field, const Geometry& geometry, const BendingSettings& settings) {
  KernelSettings result;
  result.is_splitting = settings.method == BendingMethod::splitting;
  result.step = static_cast<float>(settings.step);
  result.tolerance = static_cast<float>(settings.tolerance);
  result.max_steps = static_cast<std::uint32_t>(settings.max_steps);
  result.max_length = static_cast<float>(settings.max_length);
  result.surfaces = surfaces_within(field, geometry);
  if (!result.surfaces.isEmpty()) result.geometry = &geometry;
  return result;
}

/// Rays of a batch that bend at the same time: from their entry into the field, or from a later one into the cut.
struct TracedBatch {
  packets::KernelRays kernel;
  std::vector<std::size_t> numbers;  // Number, in the batch, of each ray of the kernel.
  std::vector<Travelled> travelled;  // State of each ray before the kernel.
  bool enters_again = false;
  std::vector<std::vector<StepPoint>> points;  // Of rays that are recorded and enter again.
};

Eigen::Vector3d to_vector(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

/// A ray at the point where it begins to bend, except for its strength.
template <int N>
KernelRay kernel_ray(const TensorField& field, Tracer<N>& tracer) {
  KernelRay ray;
  ray.place = brick_point(field, field.to_index() * Eigen::Vector3d(tracer.state().position()));
  for (int axis = 0; axis < 3; ++axis) ray.direction[axis] = static_cast<float>(tracer.state().V(axis, 0));
  return ray;
}

/// Whether the field may be so strong, where a ray begins to bend, that steps must be shorter.
bool may_be_strong(const TensorField& field, const KernelRay& ray, double strength) {
  const double longest_voxel = field.to_world().linear().norm();
  const TensorBrick brick = field.brick({ray.place.brick[0], ray.place.brick[1], ray.place.brick[2]});
  return std::abs(strength) * longest_voxel * brick.strongest > 0.1;
}

packets::KernelDifferential kernel_differential(const TensorField& field, const State<3>& state) {
  const Eigen::Matrix<double, 3, 2> position = field.to_index().linear() * state.P.rightCols<2>();
  packets::KernelDifferential result;
  for (int i = 0; i < 2; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      result.position[i][axis] = static_cast<float>(position(axis, i));
      result.direction[i][axis] = static_cast<float>(state.V(axis, i + 1));
    }
  return result;
}

/// State of a ray after the kernel.
template <int N>
State<N> state_of(const TensorField& field, const packets::KernelRays& kernel, std::size_t i) {
  const KernelRay& ray = kernel.rays[i];
  Eigen::Vector3d index = index_position(ray.place);
  if (ray.axis >= 0 && ray.axis < packets::on_surface) {
    const Eigen::AlignedBox3d& box = field.index_bounds();
    const int axis = ray.axis;
    const double face = index[axis] > box.center()[axis] ? box.max()[axis] : box.min()[axis];
    // Light nearly parallel to the face may end beside it.
    if (std::abs(index[axis] - face) < face_margin) index[axis] = face;
  }
  State<N> state;
  state.log_radiance_scale = ray.log_radiance_scale;
  state.P.col(0) = field.to_world() * index;
  state.V.col(0) = to_vector(ray.direction);
  if constexpr (N == 3) {
    for (int k = 0; k < 2; ++k)
      for (int axis = 0; axis < 3; ++axis) {
        state.P(axis, k + 1) = kernel.differentials[i].position[k][axis];
        state.V(axis, k + 1) = kernel.differentials[i].direction[k][axis];
      }
    state.P.template rightCols<2>() = (field.to_world().linear() * state.P.template rightCols<2>()).eval();
  }
  return bending_steps::normalized(state);
}

/// Where the step of a ray ends that lands on a surface.
template <int N>
State<N> end_of_step(const TensorField& field, const KernelRay& ray) {
  State<N> end{Eigen::Matrix<double, 3, N>::Zero(), Eigen::Matrix<double, 3, N>::Zero()};
  end.P.col(0) = field.to_world() * index_position({ray.place.brick, ray.end});
  end.V.col(0) = to_vector(ray.end_direction).normalized();
  return end;
}

bool same_start(const RayBatch& batch, std::size_t i, std::size_t j) {
  const bool same = batch.position[i] == batch.position[j] && batch.direction[i] == batch.direction[j];
  return same &&
         (batch.differentials.empty() || (batch.differentials[i].position == batch.differentials[j].position &&
                                          batch.differentials[i].direction == batch.differentials[j].direction));
}

/// Where a ray is recorded before the kernel.
PathPoints* before(RayRecord* records, std::size_t i) { return records ? &records[i].before : nullptr; }

/// Adds a ray to those of the kernel. @param ray  At the tracer's point.
template <int N>
void add_ray(const TensorField& field, const Tracer<N>& tracer, KernelRay ray, double strength, std::size_t number,
             TracedBatch& traced) {
  const Travelled travelled = tracer.travelled();
  ray.strength = static_cast<float>(strength);
  ray.length = travelled.length;
  ray.steps = travelled.steps;
  ray.log_radiance_scale = static_cast<float>(tracer.state().log_radiance_scale);
  traced.kernel.rays.push_back(ray);
  if constexpr (N == 3) traced.kernel.differentials.push_back(kernel_differential(field, tracer.state()));
  traced.numbers.push_back(number);
  traced.travelled.push_back(travelled);
}

/// The same for a ray that is where another one of the kernel is.
void add_copy(std::size_t place, double strength, std::size_t number, TracedBatch& traced) {
  packets::KernelRays& kernel = traced.kernel;
  kernel.rays.push_back(kernel.rays[place]);
  kernel.rays.back().strength = static_cast<float>(strength);
  if (!kernel.differentials.empty()) kernel.differentials.push_back(kernel.differentials[place]);
  traced.numbers.push_back(number);
  traced.travelled.push_back(traced.travelled[place]);
}

/// For each ray, the first one that starts as it does.
std::vector<std::size_t> first_rays(const RayBatch& batch) {
  constexpr std::size_t none = ~std::size_t{0};
  std::vector<std::size_t> firsts(batch.size()), table(2 * batch.size() + 1, none);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const auto bytes = [](const auto& v) { return std::string_view(reinterpret_cast<const char*>(&v), sizeof v); };
    std::uint64_t hash = content_hash(bytes(batch.position[i]), content_hash(bytes(batch.direction[i])));
    while (table[hash % table.size()] != none && !same_start(batch, table[hash % table.size()], i)) ++hash;
    std::size_t& first = table[hash % table.size()];
    if (first == none) first = i;
    firsts[i] = first;
  }
  return firsts;
}

/// What set_end has written of one ray, for another one that takes the same way.
template <int N>
void copy_end(RayBatch& batch, std::size_t from, std::size_t to) {
  batch.end[to] = batch.end[from];
  batch.position[to] = batch.position[from];
  batch.direction[to] = batch.direction[from];
  if constexpr (N == 3) batch.differentials[to] = batch.differentials[from];
  if (batch.wants_log_radiance_scale) batch.log_radiance_scale[to] = batch.log_radiance_scale[from];
  batch.length[to] = batch.length[from];
  batch.steps[to] = batch.steps[from];
}

/// Moves the rays of the batch to the points where they begin to bend, those of one origin together. Sets the end of
/// rays that do not reach the field.
template <int N>
void approach(const TensorField& field, const BendingSettings& settings, RayBatch& batch, RayRecord* records,
              Tracer<N>& tracer, TracedBatch& traced) {
  constexpr std::size_t none = ~std::size_t{0};
  double strongest = 0;
  for (std::size_t i = 0; i < batch.size(); ++i)
    strongest = std::max(strongest, std::abs(strength_of(batch, i, settings)));
  const std::vector<std::size_t> firsts = first_rays(batch);
  std::vector<std::size_t> places(batch.size(), none);  // Of each ray in the kernel.
  std::vector<char> has_ended(batch.size(), 0);         // Before the field.
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const double strength = strength_of(batch, i, settings);
    if (const std::size_t place = places[firsts[i]]; place != none && std::isfinite(strength)) {
      if (records) records[i].before = records[firsts[i]].before;
      add_copy(place, strength, i, traced);
      continue;
    }
    if (has_ended[firsts[i]] != 0 && std::isfinite(strength)) {
      copy_end<N>(batch, firsts[i], i);
      if (records) records[i].before = records[firsts[i]].before;
      continue;
    }
    const auto end = tracer.approach(start_of<N>(batch, i), before(records, i));
    if (end || !std::isfinite(strength)) {
      has_ended[i] = std::isfinite(strength);
      set_end(batch, i, std::isfinite(strength) ? *end : RayEnd::degenerate, tracer);
      continue;
    }
    KernelRay ray = kernel_ray(field, tracer);
    if (may_be_strong(field, ray, strongest)) ray.norm = static_cast<float>(tracer.deviator_here());
    tracer.record(true);
    places[i] = traced.numbers.size();
    add_ray(field, tracer, ray, strength, i, traced);
  }
}

/// Where ray i of the kernel is recorded from the point on where the kernel stopped; null: it is not recorded.
PathPoints* behind(const TensorField& field, const TracedBatch& traced, std::size_t i, bool is_left,
                   RayRecord* records) {
  if (!records) return nullptr;
  RayRecord& record = records[traced.numbers[i]];
  if (traced.enters_again)
    for (const StepPoint& step : traced.points[i])
      record.behind.push_back(path_point(field, step, traced.travelled[i].length));
  if (is_left) return &record.behind;
  // The last point is recorded again.
  if (traced.enters_again)
    record.behind.pop_back();
  else
    record.steps.empty() ? record.before.pop_back() : record.steps.pop_back();
  return &record.behind;
}

/// Continues a ray that the kernel has left on a surface.
template <int N>
std::optional<RayEnd> finish_on_surface(const packets::SurfaceLanding& landing, double way, Tracer<N>& tracer) {
  if (landing.hit.surface == Surface::plate) return RayEnd::plate;
  if (landing.hit.surface == Surface::obstacle) return RayEnd::obstacle;
  return tracer.leave_cut(way);
}

/// Moves a point in single precision onto a surface.
template <int N>
void move_to_surface(const packets::SurfaceLanding& landing, State<N>& state) {
  const Eigen::Vector3d& normal = landing.hit.normal;
  const double slope = normal.dot(state.direction());
  if (std::abs(slope) > 0.1) state.P.col(0) += normal.dot(landing.point - state.position()) / slope * state.V.col(0);
}

/// Follows ray i of the kernel from the point where the kernel stopped to its end, or to where it enters the cut again;
/// then returns nothing.
template <int N>
std::optional<RayEnd> finish(const TensorField& field, const TracedBatch& traced, std::size_t i, double strength,
                             RayRecord* records, Tracer<N>& tracer) {
  const KernelRay& ray = traced.kernel.rays[i];
  Travelled travelled = traced.travelled[i];
  const double way = ray.length - travelled.length;
  travelled.length = ray.length;
  travelled.steps = ray.steps;
  PathPoints* const record = behind(field, traced, i, ray.axis >= 0, records);
  State<N> state = state_of<N>(field, traced.kernel, i);
  if (ray.axis == packets::on_surface) move_to_surface(traced.kernel.landings[i], state);
  tracer.take_over(state, strength, travelled, record);
  if (ray.axis >= 0) {
    if (tracer.state().direction().isZero()) return RayEnd::degenerate;
    tracer.record(true);
    return ray.axis == packets::on_surface ? finish_on_surface(traced.kernel.landings[i], way, tracer) : tracer.leave();
  }
  const State<N> end = end_of_step<N>(field, ray);
  const bool is_known = ray.lands && end.P.allFinite() && !end.direction().isZero();
  return tracer.follow(double{ray.step}, is_known ? &end : nullptr);
}

/// Traces rays that are in the field to their ends. @return those that have left the cut and entered it again.
template <int N>
TracedBatch trace_once(const TensorField& field, const KernelSettings& settings, const BendingSettings& bending,
                       TracedBatch& traced, RayBatch& batch, RayRecord* records, Tracer<N>& tracer) {
  if (traced.enters_again) traced.points.resize(records ? traced.numbers.size() : 0);
  for (std::size_t i = 0; records && i < traced.numbers.size(); ++i)
    traced.kernel.points.push_back(traced.enters_again ? &traced.points[i] : &records[traced.numbers[i]].steps);
  batch.tensor_samples += packets::run(field, settings, traced.kernel);
  TracedBatch again;
  again.enters_again = true;
  for (std::size_t i = 0; i < traced.numbers.size(); ++i) {
    const std::size_t number = traced.numbers[i];
    const double strength = strength_of(batch, number, bending);
    auto end = finish(field, traced, i, strength, records, tracer);
    if (!end && tracer.travelled().steps >= settings.max_steps) end = RayEnd::step_limit;
    if (end) {
      set_end(batch, number, *end, tracer);
      continue;
    }
    KernelRay ray = kernel_ray(field, tracer);
    if (may_be_strong(field, ray, strength)) ray.norm = static_cast<float>(tracer.deviator_here());
    tracer.record(true);
    add_ray(field, tracer, ray, strength, number, again);
  }
  return again;
}

template <int N>
void trace_in_packets(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                      RayBatch& batch, RayRecord* records, Tracer<N>& tracer) {
  TracedBatch traced;
  approach(field, settings, batch, records, tracer, traced);
  const KernelSettings of_kernel = kernel_settings(field, geometry, settings);
  do {
    traced = trace_once(field, of_kernel, settings, traced, batch, records, tracer);
  } while (!traced.numbers.empty());
}

template <int N>
void trace_ray_by_ray(const BendingSettings& settings, RayBatch& batch, RayRecord* records, Tracer<N>& tracer) {
  for (std::size_t i = 0; i < batch.size(); ++i) {
    const RayEnd end = tracer.trace(start_of<N>(batch, i), strength_of(batch, i, settings), before(records, i));
    set_end(batch, i, end, tracer);
  }
}

/// Packets have `splitting4` in cubic fields, `splitting` with a given step there, and no automatic steps with a
/// smaller tolerance.
bool fits_packets(const TensorField& field, const BendingSettings& settings) {
  const bool is_given = settings.step > 0;
  const bool has_method = settings.method == BendingMethod::splitting4
                              ? is_given || settings.tolerance >= min_tolerance
                              : settings.method == BendingMethod::splitting && is_given;
  return has_method && field.is_cubic() && packets::lane_count() > 1;
}

void check(const BendingSettings& settings, const RayBatch& batch) {
  if (!std::isfinite(settings.scale)) throw std::invalid_argument("the field's scale must be finite");
  if (!(settings.step >= 0) || !std::isfinite(settings.step))
    throw std::invalid_argument("bending.step must be automatic, or a positive number of voxels");
  if (!(settings.tolerance > 0)) throw std::invalid_argument("bending.tolerance must be positive");
  if (settings.max_steps < 1) throw std::invalid_argument("bending.max_steps must be positive");
  if (!(settings.max_length > 0)) throw std::invalid_argument("the greatest length of a ray must be positive");
  if (!batch.differentials.empty() && batch.differentials.size() != batch.size())
    throw std::invalid_argument("a batch must have differentials for every ray or for none");
  if (!batch.differentials.empty() && batch.wants_log_radiance_scale)
    throw std::invalid_argument("rays with differentials have no radiance change; leave out one of them");
}

template <int N>
void trace_all(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
               RayRecord* records, bool in_packets) {
  batch.end.resize(batch.size());
  batch.length.resize(batch.size());
  batch.steps.resize(batch.size());
  if (batch.wants_log_radiance_scale) batch.log_radiance_scale.resize(batch.size());
  Tracer<N> tracer(field, geometry, settings);
  if (in_packets)
    trace_in_packets(field, geometry, settings, batch, records, tracer);
  else
    trace_ray_by_ray(settings, batch, records, tracer);
  batch.tensor_samples += tracer.samples();
}

void trace_batch(const TensorField& field, const Geometry& geometry, const BendingSettings& wanted, RayBatch& batch,
                 RayRecord* records, bool may_use_packets) {
  const BendingSettings settings = resolved(wanted, field);
  check(settings, batch);
  const bool in_packets = may_use_packets && fits_packets(field, settings);
  if (batch.differentials.empty())
    trace_all<1>(field, geometry, settings, batch, records, in_packets);
  else
    trace_all<3>(field, geometry, settings, batch, records, in_packets);
}

}  // namespace

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<RayRecord>* records) {
  if (records) {
    records->resize(batch.size());
    for (RayRecord& record : *records) {
      record.before.clear();
      record.steps.clear();
      record.behind.clear();
    }
  }
  trace_batch(field, geometry, settings, batch, records ? records->data() : nullptr, true);
}

void trace_reference(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                     RayBatch& batch) {
  trace_batch(field, geometry, settings, batch, nullptr, false);
}

}  // namespace tensorray
