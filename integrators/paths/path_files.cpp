#include "integrators/paths/path_files.h"

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <string>

#include "base/errors.h"
#include "base/progress.h"
#include "base/text.h"
#include "integrators/paths/path_formats.h"

namespace tensorray {
namespace {

std::string lower_case_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

[[noreturn]] void throw_unknown_ending(const std::filesystem::path& path) {
  throw std::invalid_argument(path.string() + ": the ending of a file of paths must be .vtp or .tck");
}

/// The slope at the middle one of three points, from those (unit) of the pieces before and behind it, of lengths `h`
/// and `k`: that of the parabola through them.
Eigen::Vector3d parabola_slope(const Eigen::Vector3d& before, double h, const Eigen::Vector3d& behind, double k) {
  const Eigen::Vector3d slope = (k * before + h * behind) / (h + k);
  return slope.norm() > 0 ? Eigen::Vector3d(slope.normalized()) : behind;
}

void set_directions(Way& way) {
  const std::size_t pieces = way.size() - 1;
  const auto length = [&](std::size_t i) { return way[i + 1].length - way[i].length; };
  const auto piece = [&](std::size_t i) -> Eigen::Vector3d {
    return (way[i + 1].position - way[i].position).normalized();
  };
  for (std::size_t i = 1; i < pieces; ++i)
    way[i].direction = parabola_slope(piece(i - 1), length(i - 1), piece(i), length(i));
  // At the ends the same parabola: its slopes at a piece's ends are those of the piece in the mean.
  way.front().direction = pieces > 1 ? (2 * piece(0) - way[1].direction).normalized() : piece(0);
  way.back().direction = pieces > 1 ? (2 * piece(pieces - 1) - way[pieces - 1].direction).normalized() : piece(0);
}

void set_changes(Way& way) {
  for (std::size_t i = 0; i < way.size(); ++i) {
    const Waypoint &before = way[i > 0 ? i - 1 : i], &behind = way[std::min(i + 1, way.size() - 1)];
    const Eigen::Vector3d slope = (behind.direction - before.direction) / (behind.length - before.length);
    way[i].change = slope - way[i].direction.dot(slope) * way[i].direction;
  }
}

}  // namespace

Way bare_way(const std::vector<Eigen::Vector3d>& positions) {
  Way way;
  for (const Eigen::Vector3d& position : positions) {
    // Lengths must grow, so points nearer than the rounding of the length are one.
    const double length = way.empty() ? 0 : way.back().length + (position - way.back().position).norm();
    if (!way.empty() && !(length > way.back().length)) continue;
    way.emplace_back();
    way.back().position = position;
    way.back().length = length;
    way.back().in_field = true;
  }
  if (way.size() < 2) return {};
  set_directions(way);
  set_changes(way);
  return way;
}

void write_paths(const std::filesystem::path& path, const std::vector<Path>& paths) {
  const std::string ending = lower_case_ending(path);
  if (ending == ".vtp") return write_vtp_paths(path, paths);
  if (ending == ".tck") return write_tck_paths(path, paths);
  throw_unknown_ending(path);
}

std::vector<Path> read_paths(const std::filesystem::path& path) {
  const std::string ending = lower_case_ending(path);
  if (ending != ".vtp" && ending != ".tck") throw_unknown_ending(path);
  require_readable(path);
  try {
    std::vector<Path> paths = ending == ".vtp" ? read_vtp_paths(path) : read_tck_paths(path);
    if (paths.empty()) throw std::runtime_error("it holds no path of two points or more");
    return paths;
  } catch (const Cancelled&) {
    throw;
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read the paths " + path.string() + ": " + one_line(error.what()));
  }
}

}  // namespace tensorray
