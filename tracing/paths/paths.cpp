#include "tracing/paths/paths.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <tbb/enumerable_thread_specific.h>

#include "base/process/job.h"
#include "tracing/paths/path_thinning.h"
#include "tracing/steps/scalar_tracer.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

constexpr std::size_t batch_size = 32;      // Paths that are traced together: a packet of rays.
constexpr std::size_t round_batches = 128;  // That ranks give each other at once.
constexpr double closest = 1e-9;            // Points nearer to each other than this, in voxels, count as one.

/// What the threads share and do not change.
struct PathJob {
  const TensorField& field;
  const Geometry& geometry;
  const BendingSettings& bending;
  const PathSettings& settings;
  double voxel = 0;  // Size of a voxel, world units.
};

/// Work space of one thread. It keeps its memory.
struct PathWorker {
  std::vector<RayRecord> back, on;
  JoinedRay ray;
  PathSamples samples;
};

/// Follows the light of some seeds.
RayBatch follow(const PathJob& job, const PathSeed* seeds, std::size_t count, bool backwards,
                std::vector<RayRecord>& records) {
  RayBatch batch;
  const double sign = backwards ? -1 : 1;
  for (std::size_t i = 0; i < count; ++i)
    batch.add(seeds[i].position, sign * seeds[i].direction, sign * seeds[i].flexibility);
  trace(job.field, job.geometry, job.bending, batch, &records);
  return batch;
}

/// The points of a ray with the given numbers. Their lengths are from the ray's first point.
PathPoints chosen(const TensorField& field, const JoinedRay& ray, const std::vector<std::size_t>& numbers) {
  PathPoints points;
  points.reserve(numbers.size());  // Saves memory: there may be many paths.
  const auto add = [&](PathPoint point) {
    point.length -= ray.points.front().point.length;
    points.push_back(point);
  };
  std::size_t first = 0;  // Number of the joined point.
  auto number = numbers.begin();
  for (const JoinedPoint& joined : ray.points) {
    if (number != numbers.end() && *number == first) {
      add(joined.point);
      ++number;
    }
    for (++first; number != numbers.end() && *number < first + joined.steps.count; ++number)
      add(path_point(field, ray, joined.steps, *number - first));
    first += joined.steps.count;
  }
  return points;
}

/// What `Path` keeps of the points of a ray.
PathPoints kept_points(const PathJob& job, double flexibility, PathWorker& worker) {
  JoinedRay& ray = worker.ray;
  if (!job.settings.outside) remove_outside(ray);
  const double gap = std::max(0.5 * job.settings.tolerance, 10 * closest) * job.voxel;
  remove_coincident(ray, gap, closest * job.voxel);
  if (ray.points.size() < 2) return {};
  sample_path(job.field, ray, job.settings.tensors, worker.samples);
  const auto numbers = thinned(worker.samples, job.settings.tolerance, job.settings.tensor_tolerance);
  PathPoints points = chosen(job.field, ray, numbers);
  if (job.settings.tensors) set_tensors(job.field, flexibility * job.bending.scale, points);
  return points;
}

/// Traces the paths of some seeds. Their rays are traced together.
void trace_batch(const PathJob& job, const PathSeed* seeds, std::size_t count, PathWorker& worker, Path* paths) {
  const RayBatch on = follow(job, seeds, count, false, worker.on);
  RayBatch back;
  worker.back.resize(count);  // Empty if light is not followed back.
  if (job.settings.backwards) back = follow(job, seeds, count, true, worker.back);
  for (std::size_t i = 0; i < count; ++i) {
    paths[i].flexibility = seeds[i].flexibility;
    paths[i].wavelength = seeds[i].wavelength;
    paths[i].end = on.end[i];
    if (job.settings.backwards) paths[i].backward_end = back.end[i];
    join(job.field, worker.back[i], worker.on[i], worker.ray);
    paths[i].points = kept_points(job, seeds[i].flexibility, worker);
  }
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
  tbb::enumerable_thread_specific<PathWorker> workers;
  Units batches;
  batches.count = (seeds.size() + batch_size - 1) / batch_size;
  batches.for_all = true;
  batches.round = round_batches;
  const auto begin_of = [](std::size_t batch) { return batch * batch_size; };
  const auto end_of = [&](std::size_t batch) { return std::min((batch + 1) * batch_size, seeds.size()); };
  batches.make = [&](std::size_t batch) {
    const std::size_t begin = begin_of(batch);
    trace_batch(job, &seeds[begin], end_of(batch) - begin, workers.local(), &paths[begin]);
  };
  batches.copy = [&](std::size_t batch, Archive& archive) {
    for (std::size_t i = begin_of(batch); i < end_of(batch); ++i) {
      archive.copy_list(paths[i].points);
      archive.copy(paths[i].flexibility);
      archive.copy(paths[i].wavelength);
      archive.copy(paths[i].end);
      archive.copy(paths[i].backward_end);
    }
  };
  make_units(batches, settings.job, "tracing paths", progress);
  return paths;
}

}  // namespace tensorray
