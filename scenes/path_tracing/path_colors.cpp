#include "scenes/path_tracing/path_colors.h"

#include <algorithm>
#include <cmath>

#include "renderer/charts/color_bar.h"
#include "scenes/outputs/wavelength_color.h"
#include "scenes/path_tracing/path_tracing_keys.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {
namespace {

constexpr std::size_t judged = 200000;  // Number of points that is enough to choose a range.

double transverse_force(const PathPoint& point) {
  const Eigen::Vector3d force = point.force();
  return (force - point.direction.dot(force) * point.direction).norm();
}

std::function<double(const PathPoint&)> value_of(const PathColorDescription& description) {
  switch (description.by) {
    case PathColor::force:
      return [](const PathPoint& point) { return point.force().norm(); };
    case PathColor::transverse_force:
      return transverse_force;
    case PathColor::curvature:
      return [](const PathPoint& point) { return point.change.norm(); };
    case PathColor::length:
      return [](const PathPoint& point) { return point.length; };
    case PathColor::invariant:
      return [which = description.invariant](const PathPoint& point) { return invariant(which, point.tensor); };
    default:
      return {};
  }
}

std::string title_of(const PathColorDescription& description) {
  switch (description.by) {
    case PathColor::force:
      return "|T V|";
    case PathColor::transverse_force:
      return "|T V| across";
    case PathColor::curvature:
      return "|V'|";
    case PathColor::invariant:
      return choice_name(description.invariant);
    default:
      return choice_name(description.by);
  }
}

ValueRange range_of(const PathColorDescription& description, const std::vector<Path>& paths,
                    const std::function<double(const PathPoint&)>& value) {
  if (description.range) return {description.range->x(), description.range->y(), description.logarithmic};
  std::size_t count = 0;
  for (const Path& path : paths) count += path.points.size();
  const std::size_t stride = count / judged + 1;
  std::vector<double> values;
  std::size_t i = 0;
  for (const Path& path : paths)
    for (const PathPoint& point : path.points)
      if (point.in_field && i++ % stride == 0) values.push_back(value(point));
  RangeChoice choice;
  choice.logarithmic = description.logarithmic;
  choice.symmetric = description.map == Colormap::cool_warm && !description.logarithmic;
  return choose_range(std::move(values), choice);
}

PathColors wavelength_colors(const std::vector<Path>& paths) {
  PathColors colors;
  colors.color = [](const Path& path, const PathPoint&) { return wavelength_color(path.wavelength); };
  ValueRange range{380, 730};
  for (const Path& path : paths) {
    range.low = &path == &paths.front() ? path.wavelength : std::min(range.low, path.wavelength);
    range.high = &path == &paths.front() ? path.wavelength : std::max(range.high, path.wavelength);
  }
  if (range.high - range.low < 1) return colors;
  colors.legend = [range](Image& image, const Eigen::Matrix3d& from_rec709) {
    draw_color_bar(image, {"nm", range, [&](double position) -> Eigen::Vector3d {
                             return from_rec709 * wavelength_color(range.value(position));
                           }});
  };
  return colors;
}

PathColors direction_colors() {
  PathColors colors;
  colors.color = [](const Path&, const PathPoint& point) -> Eigen::Vector3d { return point.direction.cwiseAbs(); };
  colors.legend = [](Image& image, const Eigen::Matrix3d& from_rec709) {
    ColorKey key = direction_key();
    for (ColorKeyEntry& entry : key.entries) entry.color = from_rec709 * entry.color;
    draw_color_key(image, key);
  };
  return colors;
}

}  // namespace

PathColors path_colors(const PathColorDescription& description, const std::vector<Path>& paths) {
  if (description.by == PathColor::wavelength) return wavelength_colors(paths);
  if (description.by == PathColor::direction) return direction_colors();
  PathColors colors;
  const auto value = value_of(description);
  if (!value) return colors;
  const ValueRange range = range_of(description, paths, value);
  colors.color = [value, range, map = description.map](const Path&, const PathPoint& point) {
    return colormap_linear(map, range.position(value(point)));
  };
  colors.legend = [range, map = description.map, title = title_of(description)](Image& image,
                                                                                const Eigen::Matrix3d& from_rec709) {
    draw_color_bar(image, {title, range, [&](double position) -> Eigen::Vector3d {
                             return from_rec709 * colormap_linear(map, position);
                           }});
  };
  return colors;
}

}  // namespace tensorray
