#include "tracing/paths/joined_ray.h"

#include <algorithm>

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

}  // namespace tensorray
