#include "integrators/path_tracing/path_colors.h"

#include <algorithm>

#include <tbb/parallel_for.h>

#include "scenes/outputs/picture_outputs.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {
namespace {

constexpr std::size_t judged = 200000;   // Number of points that is enough to choose a range.
constexpr std::size_t widest_line = 10;  // Letters in a line of a title, if its words allow it.

double transverse_force(const PathPoint& point) {
  const Eigen::Vector3d force = point.force();
  return (force - point.direction.dot(force) * point.direction).norm();
}

/// Of colours by a number; empty for the others.
std::function<double(const PathPoint&)> value_of(const PathColorDescription& description) {
  const PathColor by = description.by;
  if (by == PathColor::force) return [](const PathPoint& point) { return point.force().norm(); };
  if (by == PathColor::transverse_force) return transverse_force;
  if (by == PathColor::curvature) return [](const PathPoint& point) { return point.change.norm(); };
  if (by == PathColor::length) return [](const PathPoint& point) { return point.length; };
  if (by != PathColor::invariant) return {};
  return [which = description.invariant](const PathPoint& point) { return invariant(which, point.tensor); };
}

/// Words below each other, and the unit.
std::string title_of(const PathColorDescription& description, const FieldUnits& units) {
  const PathColor by = description.by;
  if (by == PathColor::force) return "|T V|\n" + units.tensor;
  if (by == PathColor::transverse_force) return "|T V|\nacross\n" + units.tensor;
  if (by == PathColor::curvature) return units.length.empty() ? "|V'|" : "|V'|\n1/" + units.length;
  if (by == PathColor::invariant) return invariant_title(description.invariant, units);
  return choice_name(by) + ("\n" + units.length);
}

/// A title with breaks at spaces, so that a long unit does not make the legend wide.
std::string narrow(std::string title) {
  std::size_t start = 0;  // Of the line.
  for (std::size_t i = 0; i < title.size(); ++i) {
    const std::size_t end = std::min(title.find_first_of(" \n", i + 1), title.size());  // Of the next word.
    if (title[i] == ' ' && end - start > widest_line) title[i] = '\n';
    if (title[i] == '\n') start = i + 1;
  }
  return title;
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

/// How far a path is from the points of another one, in their order: the nearest segment moves on along the path.
class DistanceTo {
 public:
  explicit DistanceTo(const PathPoints& way) : way_(way) {}

  double next(const Eigen::Vector3d& point) {
    double least = distance(segment_, point);
    while (segment_ + 2 < way_.size()) {
      const double further = distance(segment_ + 1, point);
      if (further > least) break;
      least = further;
      ++segment_;
    }
    return least;
  }

 private:
  double distance(std::size_t segment, const Eigen::Vector3d& point) const {
    const Eigen::Vector3d from = way_[segment].position, along = way_[segment + 1].position - from;
    const double length2 = along.squaredNorm();
    const double part = length2 > 0 ? std::clamp((point - from).dot(along) / length2, 0.0, 1.0) : 0;
    return (point - from - part * along).norm();
  }

  const PathPoints& way_;
  std::size_t segment_ = 0;
};

/// Adds the colour of another path to those of a path's points, by how much the two lie in one another.
/// @param weights  Of what was added to each point. @return whether they do anywhere.
bool add_mixture(const PathPoints& way, const Path& other, double radius, std::vector<Eigen::Vector3d>& sums,
                 std::vector<double>& weights) {
  const Eigen::Vector3d color = wavelength_color(other.wavelength);
  DistanceTo distance(other.points);
  bool is_near = false;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const double weight = std::max(0.0, 1 - distance.next(way[i].position) / radius);
    sums[i] += weight * color;
    weights[i] += weight;
    is_near = is_near || weight > 0;
  }
  return is_near;
}

/// Whether a path has the seed of the one before it: paths of a seed rise in wavelength, or, in RGB mode, fall.
bool has_seed_before(const std::vector<Path>& paths, std::size_t path) {
  const auto rises = [&](std::size_t i) { return paths[i].wavelength > paths[i - 1].wavelength; };
  return paths[path].wavelength != paths[path - 1].wavelength && rises(path) == rises(1);
}

/// The colours of the points of a path, with those of paths of its seed that it lies in.
std::vector<Eigen::Vector3d> mixed_colors(const std::vector<Path>& paths, std::size_t path, double radius) {
  const PathPoints& way = paths[path].points;
  std::vector<Eigen::Vector3d> colors(way.size(), wavelength_color(paths[path].wavelength));
  std::vector<double> weights(way.size(), 1);
  for (std::size_t i = path + 1; i < paths.size() && has_seed_before(paths, i); ++i)
    if (!add_mixture(way, paths[i], radius, colors, weights)) break;
  for (std::size_t i = path; i > 0 && has_seed_before(paths, i); --i)
    if (!add_mixture(way, paths[i - 1], radius, colors, weights)) break;
  for (std::size_t i = 0; i < way.size(); ++i) colors[i] /= weights[i];
  return colors;
}

PathColors wavelength_colors(const std::vector<Path>& paths, double radius) {
  PathColors colors;
  colors.of_points.resize(paths.size());
  tbb::parallel_for(std::size_t{0}, paths.size(),
                    [&](std::size_t i) { colors.of_points[i] = mixed_colors(paths, i, radius); });
  ValueRange range{380, 730};
  for (const Path& path : paths) {
    range.low = &path == &paths.front() ? path.wavelength : std::min(range.low, path.wavelength);
    range.high = &path == &paths.front() ? path.wavelength : std::max(range.high, path.wavelength);
  }
  if (range.high - range.low < 1) return colors;
  colors.legend = bar_legend("nm", range, [range](double at) { return wavelength_color(range.value(at)); });
  return colors;
}

/// @param color  Of a point.
template <class Color>
std::vector<std::vector<Eigen::Vector3d>> colors_of(const std::vector<Path>& paths, const Color& color) {
  std::vector<std::vector<Eigen::Vector3d>> colors(paths.size());
  tbb::parallel_for(std::size_t{0}, paths.size(), [&](std::size_t i) {
    for (const PathPoint& point : paths[i].points) colors[i].push_back(color(point));
  });
  return colors;
}

PathColors direction_colors(const std::vector<Path>& paths) {
  PathColors colors;
  colors.of_points =
      colors_of(paths, [](const PathPoint& point) -> Eigen::Vector3d { return point.direction.cwiseAbs(); });
  colors.legend = [](Image& image, const Eigen::Matrix3d& from_rec709, const LegendPlace& place) {
    draw_color_key(image, {"", {{"x", from_rec709.col(0)}, {"y", from_rec709.col(1)}, {"z", from_rec709.col(2)}}},
                   place);
  };
  return colors;
}

}  // namespace

SurfaceLegend bar_legend(const std::string& title, const ValueRange& range,
                         const std::function<Eigen::Vector3d(double)>& color) {
  return [=](Image& image, const Eigen::Matrix3d& from_rec709, const LegendPlace& place) {
    draw_color_bar(image, {narrow(title), range, [&](double at) -> Eigen::Vector3d { return from_rec709 * color(at); }},
                   place);
  };
}

std::string invariant_title(Invariant which, const FieldUnits& units) {
  std::string title = choice_name(which);
  std::replace(title.begin(), title.end(), '_', '\n');
  if (which == Invariant::von_mises) title = "von Mises";
  const int degree = invariant_degree(which);
  return degree == 0 ? title : title + "\n" + units_of_power(units.tensor, degree);
}

PathColors path_colors(const PathColorDescription& description, const std::vector<Path>& paths, double radius,
                       const FieldUnits& units) {
  if (description.by == PathColor::wavelength) return wavelength_colors(paths, radius);
  if (description.by == PathColor::direction) return direction_colors(paths);
  PathColors colors;
  const auto value = value_of(description);
  if (!value) return colors;
  const ValueRange range = range_of(description, paths, value);
  colors.of_points = colors_of(paths, [&](const PathPoint& point) -> Eigen::Vector3d {
    return colormap_linear(description.map, range.position(value(point)));
  });
  colors.legend = bar_legend(title_of(description, units), range,
                             [map = description.map](double at) { return colormap_linear(map, at); });
  return colors;
}

}  // namespace tensorray
