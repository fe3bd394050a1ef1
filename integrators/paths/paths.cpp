#include "integrators/paths/paths.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <tbb/parallel_for.h>

#include "renderer/surfaces/polyline.h"

namespace tensorray {
namespace {

constexpr std::size_t chunk_size = 1024;  // Paths between two progress reports.
constexpr double closest = 1e-9;          // Points nearer than this, in voxels, are one.

/// Everything that the threads share and do not change.
struct PathJob {
  const TensorField& field;
  const Geometry& geometry;
  const BendingSettings& bending;
  const PathSettings& settings;
  double voxel = 0;  // World units.
};

Way follow(const PathJob& job, const PathSeed& seed, bool backwards, RayEnd& end) {
  RayBatch batch;
  std::vector<Way> ways;
  const double sign = backwards ? -1 : 1;
  batch.add(seed.position, sign * seed.direction, sign * seed.flexibility);
  trace(job.field, job.geometry, job.bending, batch, ways);
  end = batch.end[0];
  return std::move(ways[0]);
}

/// The way back, in the light's direction, and the way on. Both begin at the seed. (V' is the same seen from either
/// end.)
Way joined(const Way& back, const Way& on) {
  Way way;
  const double before = back.empty() ? 0 : back.back().length;
  for (auto point = back.rbegin(); point != back.rend(); ++point) {
    way.push_back(*point);
    way.back().direction = -point->direction;
    way.back().length = before - point->length;
  }
  if (!way.empty() && !on.empty()) way.pop_back();
  for (Waypoint point : on) {
    point.length += before;
    way.push_back(point);
  }
  return way;
}

void remove_outside(Way& way) {
  const auto in_field = [](const Waypoint& point) { return point.in_field; };
  way.erase(std::find_if(way.rbegin(), way.rend(), in_field).base(), way.end());
  way.erase(way.begin(), std::find_if(way.begin(), way.end(), in_field));
}

/// Moves the ends of the straight piece [first, last) off the faces where the field begins, by `gap`.
/// @return false if it is too short for that.
bool separate(Way& way, std::size_t first, std::size_t last, double gap) {
  if (way[last - 1].length - way[first].length <= 2 * gap) return false;
  const auto move = [&](Waypoint& point, double by) {
    point.position += by * point.direction;
    point.length += by;
  };
  if (first > 0) move(way[first], gap);
  if (last < way.size()) move(way[last - 1], -gap);
  return true;
}

/// Sees to it that lengths grow from point to point: separates the pairs where the field begins or ends, and drops
/// points that coincide.
void remove_coincident(Way& way, double gap, double least) {
  Way kept;
  for (std::size_t first = 0; first < way.size();) {
    std::size_t last = first + 1;
    while (last < way.size() && way[last].in_field == way[first].in_field) ++last;
    if (way[first].in_field || separate(way, first, last, gap))
      for (std::size_t i = first; i < last; ++i)
        if (kept.empty() || way[i].length - kept.back().length > least) kept.push_back(way[i]);
    first = last;
  }
  way = std::move(kept);
}

Way thinned(const Way& way, double tolerance, double tensor_tolerance) {
  const auto error = [&](std::size_t i, std::size_t j, std::size_t k) {
    const Waypoint &a = way[i], &b = way[j], &point = way[k];
    const double t = (point.length - a.length) / (b.length - a.length);
    const double apart = (a.position + t * (b.position - a.position) - point.position).norm();
    const double unlike = (a.tensor + t * (b.tensor - a.tensor) - point.tensor).norm();
    const double norm = std::max({a.tensor.norm(), b.tensor.norm(), point.tensor.norm()});
    // Zero is allowed zero.
    const auto over = [](double value, double allowed) { return value > 0 ? value / allowed : 0; };
    return std::max(over(apart, tolerance), over(unlike, tensor_tolerance * norm));
  };
  const std::vector<std::size_t> needed = tensorray::thinned(way.size(), error);
  Way kept;
  kept.reserve(needed.size());  // There may be many paths.
  for (const std::size_t i : needed) kept.push_back(way[i]);
  return kept;
}

Path trace_path(const PathJob& job, const PathSeed& seed) {
  Path path;
  path.flexibility = seed.flexibility;
  path.wavelength = seed.wavelength;
  Way way, back;
  way = follow(job, seed, false, path.end);
  if (job.settings.backwards) {
    path.backward_end.emplace();
    back = follow(job, seed, true, *path.backward_end);
  }
  way = joined(back, way);
  if (!job.settings.outside) remove_outside(way);
  const double gap = std::max(0.5 * job.settings.tolerance, 10 * closest) * job.voxel;
  remove_coincident(way, gap, closest * job.voxel);
  if (way.size() < 2) return path;
  const double start = way.front().length;
  for (Waypoint& point : way) point.length -= start;
  path.points = thinned(way, job.settings.tolerance * job.voxel, job.settings.tensor_tolerance);
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
