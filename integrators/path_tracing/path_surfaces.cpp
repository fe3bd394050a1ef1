#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "integrators/path_tracing/path_colors.h"
#include "renderer/color/color.h"
#include "renderer/meshes/mesh.h"
#include "tracing/paths/cross_section.h"

namespace tensorray {
namespace {

constexpr double radius_per_spacing = 0.16;          // Neighbours then do not touch.
constexpr double radius_per_extent = 0.01;           // Largest typical radius, in diagonals of the volume.
constexpr double thinnest = 0.2, thickest = 3;       // In typical radii.
constexpr std::uint64_t max_triangles = 60'000'000;  // About 6 GB with the search tree.

/// The place of a vertex on a path: the point of the path before it, and the fraction of the distance to the next one.
struct Place {
  std::size_t point = 0;
  double fraction = 0;

  /// @param values  One for each point of the path.
  template <class Value>
  Value interpolate(const std::vector<Value>& values) const {
    const Value &before = values[point], &after = values[std::min(point + 1, values.size() - 1)];
    return (1 - fraction) * before + fraction * after;
  }
};

Place place_on(const PathPoints& way, double value) {
  const double last = static_cast<double>(way.size() - 1);
  const double clamped = std::clamp(value, 0.0, last);
  const auto point = static_cast<std::size_t>(std::min(std::floor(clamped), std::max(0.0, last - 1)));
  return {point, clamped - static_cast<double>(point)};
}

/// What surfaces show of the points of a path.
struct PointValues {
  std::vector<double> forces, lengths;
};

PointValues values_of(const Path& path) {
  PointValues values;
  for (const PathPoint& point : path.points) {
    values.forces.push_back(point.force().norm());
    values.lengths.push_back(point.length);
  }
  return values;
}

/// Calls `visit(vertex, tube, place, values)` once for every vertex of the mesh, on all threads.
template <class Visit>
void for_each_vertex(const TubeMesh& mesh, const std::vector<Path>& paths, const Visit& visit) {
  std::vector<std::uint8_t> visited(mesh.mesh.vertices.size());  // No two tubes have a vertex in common.
  tbb::parallel_for(std::size_t{0}, paths.size(), [&](std::size_t tube) {
    const PointValues values = values_of(paths[tube]);
    const std::uint32_t first = tube == 0 ? 0 : mesh.tube_ends[tube - 1];
    for (std::uint32_t triangle = first; triangle < mesh.tube_ends[tube]; ++triangle)
      for (const std::uint32_t vertex : mesh.mesh.triangles[triangle])
        if (!std::exchange(visited[vertex], std::uint8_t{1}))
          visit(vertex, tube, place_on(paths[tube].points, static_cast<double>(mesh.values[vertex])), values);
  });
}

Eigen::Vector3f reflectance(const Eigen::Matrix3d& to_working, const Eigen::Vector3d& rec709) {
  return (to_working * rec709).cwiseMax(0).cwiseMin(1).cast<float>();
}

std::array<std::uint8_t, 3> bytes_of(const Eigen::Vector3d& rec709) {
  const Eigen::Vector3d srgb = 255 * linear_to_srgb(rec709);
  const auto byte = [](double value) { return static_cast<std::uint8_t>(std::lround(value)); };
  return {byte(srgb.x()), byte(srgb.y()), byte(srgb.z())};
}

/// Whether nothing is known of the tensors along the paths, as in most files of other programs.
bool are_bare(const std::vector<Path>& paths) {
  return std::all_of(paths.begin(), paths.end(), [](const Path& path) {
    return std::all_of(path.points.begin(), path.points.end(),
                       [](const PathPoint& point) { return point.tensor.isZero(0); });
  });
}

/// One number that changes where the displayed colour changes.
double shade_of(const PathColors& colors, std::size_t path, std::size_t point) {
  if (colors.of_points.empty()) return 0;
  return linear_to_srgb(colors.of_points[path][point]).dot(Eigen::Vector3d(0.7, 1, 0.4));
}

/// The scale at which the median semi-axis of all paths is `typical`.
double scale_for_radius(const std::vector<Path>& paths, double typical) {
  std::vector<const PathPoints*> ways;
  for (const Path& path : paths) ways.push_back(&path.points);
  return scale_for_radius(ways, typical);
}

TubeStyle tube_style(PathStyle style) {
  if (style == PathStyle::wire) return TubeStyle::wire;
  return style == PathStyle::ellipses ? TubeStyle::discs : TubeStyle::solid;
}

}  // namespace

double typical_radius(const RadiusDescription& radius, std::size_t paths, const Eigen::AlignedBox3d& volume) {
  const double face = std::pow(volume.diagonal().norm(), 2) / 3;  // Area of a face of a cube with this diagonal.
  const double spacing = std::sqrt(face / static_cast<double>(std::max<std::size_t>(1, paths)));
  return radius.typical.value_or(std::min(radius_per_spacing * spacing, radius_per_extent * volume.diagonal().norm()));
}

TubeMesh path_mesh(const std::vector<Path>& paths, const PathTracingDescription& description, const PathColors& colors,
                   double typical, double tolerance) {
  CrossSectionSettings sections;
  sections.scale = description.radius.scale ? *description.radius.scale : scale_for_radius(paths, typical);
  sections.min_radius = description.radius.min.value_or(
      std::min(thinnest * typical, description.radius.max.value_or(std::numeric_limits<double>::max())));
  // A user who gives a scale wants true sizes.
  const double greatest = description.radius.scale ? std::numeric_limits<double>::max() : thickest * typical;
  sections.max_radius = std::max(sections.min_radius, description.radius.max.value_or(greatest));
  if (are_bare(paths)) sections.min_radius = sections.max_radius = typical;
  std::vector<Tube> tubes(paths.size());
  tbb::parallel_for(std::size_t{0}, paths.size(), [&](std::size_t i) {
    const PathPoints& way = paths[i].points;
    const std::vector<CrossSection> ellipses = cross_sections(way, sections);
    tubes[i].reserve(ellipses.size());
    for (std::size_t k = 0; k < ellipses.size(); ++k)
      tubes[i].push_back(
          {way[k].position, ellipses[k].x, ellipses[k].y, static_cast<double>(k), shade_of(colors, i, k)});
  });
  TubeSettings settings;
  settings.style = tube_style(description.style);
  settings.caps = description.caps;
  settings.tolerance = tolerance;
  settings.min_segments = 4;  // For tubes that are thinner than a pixel; there may be many.
  settings.max_triangles = max_triangles;
  return make_tube_mesh(std::move(tubes), settings);
}

ShadedSurface path_surface(TubeMesh mesh, const std::vector<Path>& paths, const PathColors& colors,
                           const Eigen::Matrix3d& to_working) {
  ShadedSurface surface;
  const std::size_t count = mesh.mesh.vertices.size();
  const bool has_colors = !colors.of_points.empty();
  if (has_colors) surface.colors.resize(count);
  surface.forces.resize(count);
  surface.arc_lengths.resize(count);
  for_each_vertex(mesh, paths,
                  [&](std::uint32_t vertex, std::size_t tube, const Place& place, const PointValues& values) {
                    if (has_colors)
                      surface.colors[vertex] = reflectance(to_working, place.interpolate(colors.of_points[tube]));
                    surface.forces[vertex] = static_cast<float>(place.interpolate(values.forces));
                    surface.arc_lengths[vertex] = static_cast<float>(place.interpolate(values.lengths));
                  });
  surface.shape = std::move(mesh.mesh);
  surface.normals = std::move(mesh.normals);
  surface.path_ends = std::move(mesh.tube_ends);
  return surface;
}

ShadedSurface line_surface(const std::vector<Path>& paths, double radius, const PathColors& colors,
                           const Eigen::Matrix3d& to_working) {
  ShadedSurface surface;
  RoundCurves curves;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    for (const PathPoint& point : paths[i].points) {
      curves.points.push_back(point.position);
      surface.forces.push_back(static_cast<float>(point.force().norm()));
      surface.arc_lengths.push_back(static_cast<float>(point.length));
    }
    if (!colors.of_points.empty())
      for (const Eigen::Vector3d& color : colors.of_points[i]) surface.colors.push_back(reflectance(to_working, color));
    curves.strand_ends.push_back(static_cast<std::uint32_t>(curves.points.size()));
  }
  curves.radii.assign(curves.points.size(), static_cast<float>(radius));
  surface.shape = std::move(curves);
  surface.strands_are_paths = true;
  return surface;
}

void write_tubes(const std::filesystem::path& path, const TubeMesh& mesh, const std::vector<Path>& paths,
                 const PathColors& colors) {
  std::vector<std::array<std::uint8_t, 3>> rgb(mesh.mesh.vertices.size());
  std::vector<float> forces(rgb.size());
  const bool has_colors = !colors.of_points.empty();
  for_each_vertex(mesh, paths,
                  [&](std::uint32_t vertex, std::size_t tube, const Place& place, const PointValues& values) {
                    if (has_colors) rgb[vertex] = bytes_of(place.interpolate(colors.of_points[tube]));
                    forces[vertex] = static_cast<float>(place.interpolate(values.forces));
                  });
  VertexAttributes attributes;
  attributes.normals = &mesh.normals;
  if (has_colors) attributes.colors = &rgb;
  attributes.values = &forces;
  attributes.value_name = "force";
  write_mesh(path, mesh.mesh, attributes);
}

}  // namespace tensorray
