#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "tracing/paths/path_thinning.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

void resize(std::size_t count, bool with_tensors, PathSamples& samples) {
  samples.count = count;
  samples.room = sampled_room(count);
  const std::size_t last = samples.room + sampled_room(1);  // A vector may begin at the last point.
  samples.places.resize(2 * samples.room + last);
  samples.positions.resize(2 * samples.room + last);
  samples.lengths.resize(last);
  samples.more.resize(last);
  samples.tensors.resize(with_tensors ? 8 * samples.room + last : 0);
}

std::size_t count_of(const JoinedRay& ray) {
  std::size_t count = ray.points.size();
  for (const JoinedPoint& joined : ray.points) count += joined.steps.count;
  return count;
}

/// A brick that the ray visits.
Eigen::Vector3i first_brick(const TensorField& field, const JoinedRay& ray) {
  const auto found = std::find_if(ray.points.begin(), ray.points.end(),
                                  [](const JoinedPoint& joined) { return joined.point.in_field; });
  const PathPoint& point = found == ray.points.end() ? ray.points.front().point : found->point;
  const auto at = brick_point(field, field.to_index() * point.position).brick;
  return {at[0], at[1], at[2]};
}

/// Writes places and lengths, point after point.
class SampleWriter {
 public:
  SampleWriter(const JoinedRay& ray, const Eigen::Vector3i& brick, PathSamples& samples)
      : ray_(ray), brick_(brick), start_(ray.points.front().point.length), samples_(samples) {}

  void add(const TensorField& field, const PathPoint& point) {
    const Eigen::Vector3d place =
        field.to_index() * point.position - index_position({{brick_[0], brick_[1], brick_[2]}, {}});
    add(place.cast<float>(), point.length);
  }

  void add(const StepRun& run) {
    for (std::size_t i = 0; i < run.count; ++i) add(place_from(brick_, run[i].place()), ray_.length(run, i));
  }

 private:
  void add(const Eigen::Vector3f& place, double length) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      samples_.places[axis * samples_.room + next_] = place[static_cast<Eigen::Index>(axis)];
    const double from_start = length - start_;
    const auto nearest = static_cast<float>(from_start);
    samples_.lengths[next_] = nearest;
    samples_.more[next_] = static_cast<float>(from_start - double{nearest});
    ++next_;
  }

  const JoinedRay& ray_;
  const Eigen::Vector3i brick_;
  const double start_;
  PathSamples& samples_;
  std::size_t next_ = 0;
};

void set_positions(const TensorField& field, PathSamples& samples) {
  const Eigen::Matrix3d linear = field.to_world().linear();
  const Eigen::Matrix3f to_world = (linear / std::cbrt(std::abs(linear.determinant()))).cast<float>();
  using Rows = Eigen::Map<Eigen::Array<float, Eigen::Dynamic, 3>>;
  const auto room = static_cast<Eigen::Index>(samples.room);
  const Eigen::Map<const Eigen::Array<float, Eigen::Dynamic, 3>> places(samples.places.data(), room, 3);
  Rows positions(samples.positions.data(), room, 3);
  for (int axis = 0; axis < 3; ++axis)
    positions.col(axis) =
        to_world(axis, 0) * places.col(0) + to_world(axis, 1) * places.col(1) + to_world(axis, 2) * places.col(2);
}

/// Sets the tensors of points that are not in the field.
void clear_outside(const JoinedRay& ray, PathSamples& samples) {
  std::size_t next = 0;
  for (const JoinedPoint& joined : ray.points) {
    if (!joined.point.in_field)
      for (std::size_t component = 0; component < 9; ++component) samples.tensors[component * samples.room + next] = 0;
    next += 1 + joined.steps.count;
  }
}

void set_tensors(const TensorField& field, const Eigen::Vector3i& brick, PathSamples& samples) {
  const float* const places = samples.places.data();
  const IndexPoints points{brick, {places, places + samples.room, places + 2 * samples.room}, samples.count};
  const double greatest = field.max_norm();
  const double factor = 1 / std::max<double>(greatest, std::numeric_limits<float>::min());  // Squares stay in range.
  sample_tensors(field, points, static_cast<float>(factor), samples.tensors.data(), samples.room);
}

}  // namespace

void sample_path(const TensorField& field, const JoinedRay& ray, bool with_tensors, PathSamples& samples) {
  resize(count_of(ray), with_tensors, samples);
  const Eigen::Vector3i brick = first_brick(field, ray);
  SampleWriter writer(ray, brick, samples);
  for (const JoinedPoint& joined : ray.points) {
    writer.add(field, joined.point);
    writer.add(joined.steps);
  }
  set_positions(field, samples);
  if (!with_tensors) return;
  set_tensors(field, brick, samples);
  clear_outside(ray, samples);
}

}  // namespace tensorray
