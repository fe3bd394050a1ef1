#include "integrators/path_files/path_files.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "base/errors.h"
#include "base/process/progress.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

[[noreturn]] void throw_unknown_ending(const std::filesystem::path& path) {
  throw std::invalid_argument(path.string() + ": a file of paths must end in .vtp or .tck");
}

/// The slope of the parabola through three points at the middle point. `before` and `behind` are the unit slopes of the
/// pieces before and after it, `h` and `k` their lengths.
Eigen::Vector3d parabola_slope(const Eigen::Vector3d& before, double h, const Eigen::Vector3d& behind, double k) {
  const Eigen::Vector3d slope = (k * before + h * behind) / (h + k);
  return slope.norm() > 0 ? Eigen::Vector3d(slope.normalized()) : behind;
}

void set_directions(PathPoints& points) {
  const std::size_t pieces = points.size() - 1;
  const auto length = [&](std::size_t i) { return points[i + 1].length - points[i].length; };
  const auto piece = [&](std::size_t i) -> Eigen::Vector3d {
    return (points[i + 1].position - points[i].position).normalized();
  };
  for (std::size_t i = 1; i < pieces; ++i)
    points[i].direction = parabola_slope(piece(i - 1), length(i - 1), piece(i), length(i));
  // The ends use the same parabola: the mean of its slopes at a piece's ends is the slope of the piece.
  points.front().direction = pieces > 1 ? (2 * piece(0) - points[1].direction).normalized() : piece(0);
  points.back().direction = pieces > 1 ? (2 * piece(pieces - 1) - points[pieces - 1].direction).normalized() : piece(0);
}

void set_changes(PathPoints& points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PathPoint &before = points[i > 0 ? i - 1 : i], &behind = points[std::min(i + 1, points.size() - 1)];
    const Eigen::Vector3d slope = (behind.direction - before.direction) / (behind.length - before.length);
    points[i].change = slope - points[i].direction.dot(slope) * points[i].direction;
  }
}

/// Surfaces have single precision, and directions are of squared distances.
void require_representable(const Path& path) {
  constexpr double most = 1e18;
  for (const PathPoint& point : path.points)
    if (!(point.position.cwiseAbs().maxCoeff() <= most) || !point.direction.allFinite())
      throw std::runtime_error("a point is beyond 1e18, or not finite; write it again, or in a larger unit of length");
}

}  // namespace

PathPoints bare_way(const std::vector<Eigen::Vector3d>& positions) {
  PathPoints points;
  for (const Eigen::Vector3d& position : positions) {
    // Lengths must increase. Points nearer than the rounding of the length therefore count as one.
    const double length = points.empty() ? 0 : points.back().length + (position - points.back().position).norm();
    if (!points.empty() && !(length > points.back().length)) continue;
    points.emplace_back();
    points.back().position = position;
    points.back().length = length;
    points.back().in_field = true;
  }
  if (points.size() < 2) return {};
  set_directions(points);
  set_changes(points);
  return points;
}

void write_paths(const std::filesystem::path& path, const std::vector<Path>& paths) {
  const std::string ending = lower_case_ending(path);
  if (ending == ".vtp") return write_vtp_paths(path, paths);
  if (ending == ".tck") return write_tck_paths(path, paths);
  throw_unknown_ending(path);
}

bool stores_tensors(const std::filesystem::path& path) { return lower_case_ending(path) != ".tck"; }

std::vector<Path> read_paths(const std::filesystem::path& path) {
  const std::string ending = lower_case_ending(path);
  if (ending != ".vtp" && ending != ".tck") throw_unknown_ending(path);
  require_readable(path);
  try {
    std::vector<Path> paths = ending == ".vtp" ? read_vtp_paths(path) : read_tck_paths(path);
    if (paths.empty()) throw std::runtime_error("it contains no path with two or more points");
    for (const Path& each : paths) require_representable(each);
    return paths;
  } catch (const Cancelled&) {
    throw;
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read the paths " + path.string() + ": " + one_line(error.what()));
  }
}

}  // namespace tensorray
