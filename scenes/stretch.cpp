#include "scenes/stretch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "renderer/color/color_bar.h"
#include "renderer/color/colormap.h"

namespace tensorray {
namespace {

constexpr double default_wavelength = 550;  // nm
constexpr Colormap map = Colormap::viridis;

/// Light passes obstacles as in the scene, and no plate.
Geometry without_plate(const Scene& scene) {
  Surfaces surfaces = scene.geometry.surfaces();
  surfaces.plate.reset();
  return Geometry(std::move(surfaces));
}

/// From the beam's start to where it first, and last, could meet the volume.
std::pair<double, double> depths(const Scene& scene) {
  double near = std::numeric_limits<double>::infinity(), far = -near;
  for (const Eigen::Vector3d& corner : scene.field.corners()) {
    const double depth = (corner - scene.beam.center).dot(scene.beam.direction);
    near = std::min(near, depth);
    far = std::max(far, depth);
  }
  return {near, far};
}

/// The beam's aperture, and where it meets the volume first.
Plate entry_plane(const Scene& scene, int pixels) {
  Eigen::AlignedBox2d aperture;
  for (const Eigen::Vector2d& corner : scene.beam.aperture) aperture.extend(corner);
  Plate plane;
  plane.center = scene.beam.center + depths(scene).first * scene.beam.direction +
                 aperture.center().x() * scene.beam.right + aperture.center().y() * scene.beam.up;
  plane.up = scene.beam.up;
  plane.right = plane.up.cross(-scene.beam.direction);
  plane.size = aperture.sizes();
  plane.resolution = (pixels * plane.size / plane.size.maxCoeff()).array().round().max(1).matrix().cast<int>();
  return plane;
}

}  // namespace

StretchSettings choose_stretch(const Scene& scene, const StretchRequest& request) {
  const BendingDescription& bending = scene.description.bending;
  if (bending.rgb && request.wavelength)
    throw std::invalid_argument("light has no wavelength where `bending.rgb` is given: remove one of the two");
  const auto [near, far] = depths(scene);
  StretchSettings settings;
  settings.direction = scene.beam.direction;
  settings.flexibility =
      bending.rgb ? bending.rgb->y() : bending.flexibility.at(request.wavelength.value_or(default_wavelength));
  settings.length = request.length.value_or(far - near);
  if (!(settings.length > 0)) throw std::invalid_argument("the length that light is followed for must be positive");
  return settings;
}

std::map<std::string, std::string> stretch_metadata(const Scene& scene, const StretchSettings& settings) {
  const Eigen::Vector3d& direction = settings.direction;
  return {{"tensorray:version", TENSORRAY_VERSION},
          {"tensorray:scene", scene.description.text},
          {"tensorray:scale", fmt::format("{:.17g}", scene.scale.scale)},
          {"tensorray:units", "1/length"},
          {"tensorray:length", fmt::format("{}", settings.length)},
          {"tensorray:flexibility", fmt::format("{}", settings.flexibility)},
          {"tensorray:direction", fmt::format("{} {} {}", direction.x(), direction.y(), direction.z())}};
}

ScalarGrid stretch_grid(const Scene& scene, const StretchSettings& settings, int resolution, const Progress& progress) {
  ScalarGrid grid = stretch_grid(scene.field, without_plate(scene), scene.bending, settings, resolution, progress);
  grid.metadata = stretch_metadata(scene, settings);
  return grid;
}

StretchPicture stretch_picture(const Scene& scene, const StretchSettings& settings, int pixels,
                               const Progress& progress) {
  const Plate plane = entry_plane(scene, pixels);
  const std::vector<float> values =
      stretch_picture(scene.field, without_plate(scene), scene.bending, settings, plane, progress);
  const ValueRange range = choose_range({values.begin(), values.end()});
  const Eigen::Matrix3d to_working = scene.color.xyz_to_working() * rec709_to_xyz();
  const int width = plane.resolution.x(), height = plane.resolution.y();
  StretchPicture picture{Image(width, height, {"R", "G", "B", "A", "stretch"}),
                         Image(width, height, {"R", "G", "B", "A"})};
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) continue;
    const double position = range.position(values[i]);
    Eigen::Map<Eigen::Vector3f>(&picture.linear.pixels[5 * i]) =
        (to_working * colormap_linear(map, position)).cast<float>();
    Eigen::Map<Eigen::Vector3f>(&picture.display.pixels[4 * i]) = colormap_srgb(map, position).cast<float>();
    picture.linear.pixels[5 * i + 3] = picture.display.pixels[4 * i + 3] = 1;
    picture.linear.pixels[5 * i + 4] = values[i];
  }
  draw_color_bar(picture.display, {"stretch", range, [](double position) { return colormap_srgb(map, position); }});
  return picture;
}

}  // namespace tensorray
