#include "integrators/paths/paths.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <tbb/parallel_for.h>

#include "renderer/surfaces/polyline.h"

namespace tensorray {
namespace {

constexpr std::size_t chunk_size = 1024;  // Paths between two progress reports.
constexpr double closest = 1e-9;          // Points nearer to each other than this, in voxels, count as one.

/// What the threads share and do not change.
struct PathJob {
  const TensorField& field;
  const Geometry& geometry;
  const BendingSettings& bending;
  const PathSettings& settings;
  double voxel = 0;  // Size of a voxel, world units.
};

PathPoints follow(const PathJob& job, const PathSeed& seed, bool backwards, RayEnd& end) {
  RayBatch batch;
  std::vector<PathPoints> paths;
  const double sign = backwards ? -1 : 1;
  batch.add(seed.position, sign * seed.direction, sign * seed.flexibility);
  trace(job.field, job.geometry, job.bending, batch, paths);
  end = batch.end[0];
  return std::move(paths[0]);
}

/// Joins the part behind the seed (`back`, traced backwards) and the part in front of it (`on`). Both begin at the
/// seed. The result runs in the light's direction. (V' is the same from both directions.)
PathPoints joined(const PathPoints& back, const PathPoints& on) {
  PathPoints points;
  const double before = back.empty() ? 0 : back.back().length;
  for (auto point = back.rbegin(); point != back.rend(); ++point) {
    points.push_back(*point);
    points.back().direction = -point->direction;
    points.back().length = before - point->length;
  }
  if (!points.empty() && !on.empty()) points.pop_back();
  for (PathPoint point : on) {
    point.length += before;
    points.push_back(point);
  }
  return points;
}

void remove_outside(PathPoints& points) {
  const auto in_field = [](const PathPoint& point) { return point.in_field; };
  points.erase(std::find_if(points.rbegin(), points.rend(), in_field).base(), points.end());
  points.erase(points.begin(), std::find_if(points.begin(), points.end(), in_field));
}

/// Moves the ends of the straight piece [first, last) by `gap` away from the faces where the field begins.
/// @return false if the piece is too short.
bool separate(PathPoints& points, std::size_t first, std::size_t last, double gap) {
  if (points[last - 1].length - points[first].length <= 2 * gap) return false;
  const auto move = [&](PathPoint& point, double by) {
    point.position += by * point.direction;
    point.length += by;
  };
  if (first > 0) move(points[first], gap);
  if (last < points.size()) move(points[last - 1], -gap);
  return true;
}

/// Makes lengths increase from point to point: separates the pairs of points where the field begins or ends, and
/// removes points that coincide.
void remove_coincident(PathPoints& points, double gap, double least) {
  PathPoints kept;
  for (std::size_t first = 0; first < points.size();) {
    std::size_t last = first + 1;
    while (last < points.size() && points[last].in_field == points[first].in_field) ++last;
    if (points[first].in_field || separate(points, first, last, gap))
      for (std::size_t i = first; i < last; ++i)
        if (kept.empty() || points[i].length - kept.back().length > least) kept.push_back(points[i]);
    first = last;
  }
  points = std::move(kept);
}

PathPoints thinned(const PathPoints& points, double tolerance, double tensor_tolerance) {
  const auto error = [&](std::size_t i, std::size_t j, std::size_t k) {
    const PathPoint &a = points[i], &b = points[j], &point = points[k];
    const double t = (point.length - a.length) / (b.length - a.length);
    const double apart = (a.position + t * (b.position - a.position) - point.position).norm();
    const double unlike = (a.tensor + t * (b.tensor - a.tensor) - point.tensor).norm();
    const double norm = std::max({a.tensor.norm(), b.tensor.norm(), point.tensor.norm()});
    // An error of zero is always allowed.
    const auto over = [](double value, double allowed) { return value > 0 ? value / allowed : 0; };
    return std::max(over(apart, tolerance), over(unlike, tensor_tolerance * norm));
  };
  const std::vector<std::size_t> needed = tensorray::thinned(points.size(), error);
  PathPoints kept;
  kept.reserve(needed.size());  // Saves memory: there may be many paths.
  for (const std::size_t i : needed) kept.push_back(points[i]);
  return kept;
}

Path trace_path(const PathJob& job, const PathSeed& seed) {
  Path path;
  path.flexibility = seed.flexibility;
  path.wavelength = seed.wavelength;
  PathPoints points, back;
  points = follow(job, seed, false, path.end);
  if (job.settings.backwards) {
    path.backward_end.emplace();
    back = follow(job, seed, true, *path.backward_end);
  }
  points = joined(back, points);
  if (!job.settings.outside) remove_outside(points);
  const double gap = std::max(0.5 * job.settings.tolerance, 10 * closest) * job.voxel;
  remove_coincident(points, gap, closest * job.voxel);
  if (points.size() < 2) return path;
  const double start = points.front().length;
  for (PathPoint& point : points) point.length -= start;
  path.points = thinned(points, job.settings.tolerance * job.voxel, job.settings.tensor_tolerance);
  return path;
}

}  // namespace

std::vector<Path> trace_paths(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                              const std::vector<PathSeed>& seeds, const PathSettings& settings,
                              const Progress& progress) {
  if (!(settings.tolerance >= 0)) throw std::invalid_argument("the tolerance of paths must not be negative");
  if (!(settings.tensor_tolerance >= 0))
    throw std::invalid_argument("the tensor tolerance of paths must not be negative");
  PathJob job{field, geometry, bending, settings};
  job.voxel = std::cbrt(std::abs(field.to_world().linear().determinant()));
  std::vector<Path> paths(seeds.size());
  for (std::size_t first = 0; first < seeds.size(); first += chunk_size) {
    progress.update("tracing paths", first, seeds.size());
    tbb::parallel_for(first, std::min(first + chunk_size, seeds.size()), [&](std::size_t i) {
      if (progress.cancelled) throw Cancelled();
      paths[i] = trace_path(job, seeds[i]);
    });
  }
  progress.update("tracing paths", seeds.size(), seeds.size());
  return paths;
}

}  // namespace tensorray
