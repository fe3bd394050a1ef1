#include "integrators/paths/paths.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "renderer/surfaces/polyline.h"

namespace tensorray {
namespace {

constexpr std::size_t chunk_size = 4096;  // Paths between two progress reports.
constexpr std::size_t batch_size = 32;    // Paths that are traced together: a packet of rays.
constexpr double closest = 1e-9;          // Points nearer to each other than this, in voxels, count as one.

/// What the threads share and do not change.
struct PathJob {
  const TensorField& field;
  const Geometry& geometry;
  const BendingSettings& bending;
  const PathSettings& settings;
  double voxel = 0;  // Size of a voxel, world units.
};

/// Follows the light of some seeds. @param paths  Their points; each begins at its seed.
RayBatch follow(const PathJob& job, const PathSeed* seeds, std::size_t count, bool backwards,
                std::vector<PathPoints>& paths) {
  RayBatch batch;
  const double sign = backwards ? -1 : 1;
  for (std::size_t i = 0; i < count; ++i)
    batch.add(seeds[i].position, sign * seeds[i].direction, sign * seeds[i].flexibility);
  trace(job.field, job.geometry, job.bending, batch, paths);
  return batch;
}

/// Joins the part behind the seed (`back`, traced backwards) and the part in front of it (`on`). Both begin at the
/// seed. The result runs in the light's direction. (V' is the same from both directions.)
PathPoints joined(const PathPoints& back, const PathPoints& on) {
  PathPoints points;
  points.reserve(back.size() + on.size());
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
  std::size_t kept = 0;  // Points that stay, at the front.
  for (std::size_t first = 0; first < points.size();) {
    std::size_t last = first + 1;
    while (last < points.size() && points[last].in_field == points[first].in_field) ++last;
    if (points[first].in_field || separate(points, first, last, gap))
      for (std::size_t i = first; i < last; ++i)
        if (kept == 0 || points[i].length - points[kept - 1].length > least) {
          if (kept != i) points[kept] = points[i];
          ++kept;
        }
    first = last;
  }
  points.resize(kept);
}

/// What is interpolated between the points that stay, and how far it may be off. Single precision, in vectors.
class Interpolation {
 public:
  Interpolation(const PathPoints& points, double tolerance, double tensor_tolerance)
      : values_(points.size(), 12), lengths_(points.size()), norms_(points.size()) {
    const auto factor = [](double allowed) { return std::min(static_cast<float>(1 / (allowed * allowed)), strict); };
    position_factor_ = factor(tolerance);
    tensor_factor_ = factor(tensor_tolerance);
    double greatest = std::numeric_limits<double>::min();  // The error is relative to it: squares stay in range.
    for (const PathPoint& point : points) greatest = std::max(greatest, point.tensor.norm());
    for (Eigen::Index i = 0; i < lengths_.size(); ++i) {
      const PathPoint& point = points[static_cast<std::size_t>(i)];
      values_.row(i).head<3>() = (point.position - points[0].position).cast<float>().array();
      values_.row(i).tail<9>() =
          (Eigen::Map<const Eigen::Array<double, 1, 9>>(point.tensor.data()) * (1 / greatest)).cast<float>();
      lengths_[i] = point.length;
      norms_[i] = values_.row(i).tail<9>().square().sum();
    }
  }

  /// The error is the square of the one in the tolerances' units.
  Worst worst(std::size_t first, std::size_t last) const {
    Worst found;
    for (std::size_t begin = first + 1; begin < last && found.error < strict; begin += block) {
      Eigen::Index at = 0;
      const float error = errors(first, last, begin, std::min(begin + block, last)).maxCoeff(&at);
      if (!(error <= found.error)) found = {error, begin + static_cast<std::size_t>(at)};
    }
    return found;
  }

 private:
  static constexpr std::size_t block = 64;  // Points that are compared together.
  static constexpr float strict = 1e30f;    // The factor of an error that is not allowed.
  using Block = Eigen::Array<float, Eigen::Dynamic, 1, 0, block, 1>;

  Block errors(std::size_t first, std::size_t last, std::size_t begin, std::size_t end) const {
    const auto i = static_cast<Eigen::Index>(first), j = static_cast<Eigen::Index>(last),
               from = static_cast<Eigen::Index>(begin), count = static_cast<Eigen::Index>(end - begin);
    const Block t = ((lengths_.segment(from, count) - lengths_[i]) / (lengths_[j] - lengths_[i])).cast<float>();
    const auto squared = [&](Eigen::Index value) {
      const auto column = values_.col(value);
      return (column[i] + t * (column[j] - column[i]) - column.segment(from, count)).square();
    };
    Block apart = squared(0), unlike = squared(3);
    for (Eigen::Index value = 1; value < 3; ++value) apart += squared(value);
    for (Eigen::Index value = 4; value < 12; ++value) unlike += squared(value);
    const Block norm = norms_.segment(from, count).max(std::max({norms_[i], norms_[j], least_norm}));
    return (apart * position_factor_).max(unlike * tensor_factor_ / norm);
  }

  static constexpr float least_norm = std::numeric_limits<float>::min();  // No division by zero.
  Eigen::Array<float, Eigen::Dynamic, 12> values_;  // A row for each point: its position, and its tensor's components.
  Eigen::ArrayXd lengths_;
  Eigen::ArrayXf norms_;  // Squares of the tensors' norms.
  float position_factor_ = 0, tensor_factor_ = 0;
};

PathPoints thinned(const PathPoints& points, double tolerance, double tensor_tolerance) {
  const Interpolation interpolation(points, tolerance, tensor_tolerance);
  const std::vector<std::size_t> needed = tensorray::thinned(
      points.size(), [&](std::size_t first, std::size_t last) { return interpolation.worst(first, last); });
  PathPoints kept;
  kept.reserve(needed.size());  // Saves memory: there may be many paths.
  for (const std::size_t i : needed) kept.push_back(points[i]);
  return kept;
}

/// What `Path` keeps of the points of a ray.
PathPoints kept_points(const PathJob& job, PathPoints points) {
  if (!job.settings.outside) remove_outside(points);
  const double gap = std::max(0.5 * job.settings.tolerance, 10 * closest) * job.voxel;
  remove_coincident(points, gap, closest * job.voxel);
  if (points.size() < 2) return {};
  const double start = points.front().length;
  for (PathPoint& point : points) point.length -= start;
  return thinned(points, job.settings.tolerance * job.voxel, job.settings.tensor_tolerance);
}

/// Recorded points of rays; kept from batch to batch, with their memory.
struct Recorded {
  std::vector<PathPoints> back, on;
};

/// Traces the paths of some seeds. Their rays are traced together.
void trace_batch(const PathJob& job, const PathSeed* seeds, std::size_t count, Recorded& recorded, Path* paths) {
  const RayBatch on = follow(job, seeds, count, false, recorded.on);
  RayBatch back;
  recorded.back.resize(count);  // Empty if light is not followed back.
  if (job.settings.backwards) back = follow(job, seeds, count, true, recorded.back);
  for (std::size_t i = 0; i < count; ++i) {
    paths[i].flexibility = seeds[i].flexibility;
    paths[i].wavelength = seeds[i].wavelength;
    paths[i].end = on.end[i];
    if (job.settings.backwards) paths[i].backward_end = back.end[i];
    paths[i].points = kept_points(job, joined(recorded.back[i], recorded.on[i]));
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
  tbb::enumerable_thread_specific<Recorded> recorded;
  for (std::size_t first = 0; first < seeds.size(); first += chunk_size) {
    progress.update("tracing paths", first, seeds.size());
    const std::size_t count = std::min(chunk_size, seeds.size() - first);
    tbb::parallel_for(std::size_t{0}, (count + batch_size - 1) / batch_size, [&](std::size_t batch) {
      if (progress.cancelled) throw Cancelled();
      const std::size_t begin = first + batch * batch_size, end = std::min(begin + batch_size, first + count);
      trace_batch(job, &seeds[begin], end - begin, recorded.local(), &paths[begin]);
    });
  }
  progress.update("tracing paths", seeds.size(), seeds.size());
  return paths;
}

}  // namespace tensorray
