#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "tracing/paths/path_thinning.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

/// A point that was traced backwards.
PathPoint turned(PathPoint point, double seed_length) {
  point.direction = -point.direction;
  point.length = seed_length - point.length;
  return point;
}

/// Adds steps: the first and the last one as points of the ray.
void add_steps(const TensorField& field, const StepRun& run, JoinedRay& ray) {
  ray.points.push_back({path_point(field, ray, run, 0), {}});
  if (run.count == 1) return;
  ray.points.back().steps = {run.first + run.stride, run.stride, run.count - 2, run.entry_length};
  ray.points.push_back({path_point(field, ray, run, run.count - 1), {}});
}

void add_backwards(const PathPoints& points, std::size_t first, JoinedRay& ray) {
  for (std::size_t i = points.size(); i > first; --i)
    ray.points.push_back({turned(points[i - 1], ray.seed_length), {}});
}

void add_forwards(const PathPoints& points, JoinedRay& ray) {
  for (const PathPoint& point : points) {
    ray.points.push_back({point, {}});
    ray.points.back().point.length += ray.seed_length;
  }
}

bool in_field(const JoinedPoint& joined) { return joined.point.in_field; }

/// Moves the ends of the straight piece [first, last) by `gap` away from the faces where the field begins.
/// @return false if the piece is too short.
bool separate(std::vector<JoinedPoint>& points, std::size_t first, std::size_t last, double gap) {
  if (points[last - 1].point.length - points[first].point.length <= 2 * gap) return false;
  const auto move = [&](PathPoint& point, double by) {
    point.position += by * point.direction;
    point.length += by;
  };
  if (first > 0) move(points[first].point, gap);
  if (last < points.size()) move(points[last - 1].point, -gap);
  return true;
}

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

/// A brick that the ray visits.
Eigen::Vector3i first_brick(const TensorField& field, const JoinedRay& ray) {
  const auto found = std::find_if(ray.points.begin(), ray.points.end(), in_field);
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
  const Rows places(samples.places.data(), room, 3);
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

PathPoint path_point(const TensorField& field, const JoinedRay& ray, const StepRun& run, std::size_t i) {
  PathPoint point = path_point(field, run[i], run.entry_length);
  if (run.stride < 0) return turned(point, ray.seed_length);
  point.length += ray.seed_length;
  return point;
}

void join(const TensorField& field, const RayRecord& back, const RayRecord& on, JoinedRay& ray) {
  ray.points.clear();
  ray.seed_length = back.size() > 0 ? path_point(field, back, back.size() - 1).length : 0;
  add_backwards(back.behind, 0, ray);
  if (!back.steps.empty())
    add_steps(field, {&back.steps.back(), -1, back.steps.size(), back.before.back().length}, ray);
  add_backwards(back.before, on.size() > 0 ? 1 : 0, ray);
  add_forwards(on.before, ray);
  if (!on.steps.empty()) add_steps(field, {on.steps.data(), 1, on.steps.size(), on.before.back().length}, ray);
  add_forwards(on.behind, ray);
}

void remove_outside(JoinedRay& ray) {
  std::vector<JoinedPoint>& points = ray.points;
  points.erase(std::find_if(points.rbegin(), points.rend(), in_field).base(), points.end());
  points.erase(points.begin(), std::find_if(points.begin(), points.end(), in_field));
}

void remove_coincident(JoinedRay& ray, double gap, double least) {
  std::vector<JoinedPoint>& points = ray.points;
  std::size_t kept = 0;  // Points that stay, at the front.
  for (std::size_t first = 0; first < points.size();) {
    std::size_t last = first + 1;
    while (last < points.size() && in_field(points[last]) == in_field(points[first])) ++last;
    if (in_field(points[first]) || separate(points, first, last, gap))
      for (std::size_t i = first; i < last; ++i)
        if (kept == 0 || points[i].steps.count > 0 || points[i].point.length - points[kept - 1].point.length > least) {
          if (kept != i) points[kept] = points[i];
          ++kept;
        }
    first = last;
  }
  points.resize(kept);
}

void sample_path(const TensorField& field, const JoinedRay& ray, bool with_tensors, PathSamples& samples) {
  std::size_t count = ray.points.size();
  for (const JoinedPoint& joined : ray.points) count += joined.steps.count;
  resize(count, with_tensors, samples);
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
