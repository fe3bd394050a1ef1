#include "integrators/photon_distribution/plate_light.h"

#include <algorithm>
#include <utility>

#include <Eigen/Geometry>

#include "integrators/photon_distribution/photon_distribution.h"
#include "integrators/photon_distribution/photon_distribution_method.h"
#include "renderer/film/spectral_image.h"
#include "scenes/outputs/channel_table.h"
#include "tracing/flow_drawing/flow_view.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double plate_margin = 1.0 / 16;  // Light beside the plate, as a part of its longer side.
constexpr double widest_gaussian = 4;      // Radius of a photon, in standard deviations.

/// Whether photons are collected as red, green and blue. Up to three bands need no more planes, and cost less.
bool is_collected_in_color(const Scene& scene) {
  return !scene.description.output.wants("spectral") && scene.bands.size() > 3;
}

PhotonSettings photon_settings(const Scene& scene, Job* job) {
  const SceneDescription& description = scene.description;
  PhotonSettings settings;
  settings.bending = scene.bending;
  settings.job = job;
  settings.photons = description.light.photons;
  settings.pattern = description.light.pattern;
  settings.channels_per_photon = description.bending.rgb ? 0 : description.light.wavelengths_per_photon;
  settings.seed = description.seed;
  settings.side_light = keeps_side_light(scene);
  settings.density = estimator_of(description.integrator.settings<PhotonDescription>().density);
  settings.keep_photons = description.output.wants("photons");
  if (description.output.wants("fluence"))
    settings.fluence = description.output.fluence_bands ? FluenceKind::bands : FluenceKind::all_light;
  if (is_collected_in_color(scene))
    for (const Band& band : scene.bands) settings.colors.push_back(to_working(scene) * band.xyz);
  return settings;
}

PlateLight light_of(const Scene& scene, PhotonDistribution traced) {
  PlateLight light;
  light.render.linear = is_collected_in_color(scene) ? color_image(traced.irradiance)
                                                     : linear_image(traced.irradiance, scene.bands, to_working(scene));
  light.irradiance = std::move(traced.irradiance);
  light.render.photons = std::move(traced.photons);
  light.render.grids = std::move(traced.fluence);
  Statistics& statistics = light.render.statistics;
  statistics.positions = traced.positions;
  statistics.emitted = std::move(traced.emitted);
  statistics.ends = std::move(traced.ends);
  for (const LightChannel& channel : scene.channels)
    statistics.channel_power.push_back(channel.power * traced.ray_area);
  statistics.ray_steps = traced.ray_steps;
  statistics.tensor_samples = traced.tensor_samples;
  statistics.seconds_tracing = traced.seconds_tracing;
  statistics.seconds_density = traced.seconds_density;
  return light;
}

PlateLight trace_photons(const Scene& scene, const PhotonSettings& settings, const Progress& progress) {
  PhotonDistribution traced =
      distribute_photons(scene.field, scene.geometry, beam_on_plate(scene), scene.channels, settings, progress);
  const bool has_light = !settings.job || (is_root(settings.job->ranks) && !settings.job->is_shard);
  return has_light ? light_of(scene, std::move(traced)) : PlateLight();
}

/// From pixels of a plate to the start, in the beam's frame, of straight light that lands there.
Eigen::Affine2d straight_starts(const Plate& plate, const Beam& beam) {
  const auto start = [&](const Vector2d& pixel) -> Vector2d {
    const Vector3d from_center = plate.to_world(pixel) - beam.center;
    return {from_center.dot(beam.right), from_center.dot(beam.up)};
  };
  Eigen::Affine2d map;
  map.translation() = start({0, 0});
  map.linear() << start({1, 0}) - map.translation(), start({0, 1}) - map.translation();
  return map;
}

/// How light lands at the centre of a pixel.
struct PlateLanding {
  const FlowPoint& point;
  Vector3d moved;  ///< From where straight light would land.
  PrincipalStretch stretch;
};

PlateLanding landing_of(const FlowPoint& point, const Vector2d& pixel, const Plate& plate,
                        const Eigen::Affine2d& straight) {
  // World units on the plate, along right and up, by those across the beam.
  const Vector2d pixel_size = plate.pixel_size();
  const Eigen::Matrix2d jacobian =
      Vector2d(pixel_size.x(), -pixel_size.y()).asDiagonal() * point.jacobian.cast<double>();
  return {point, plate.to_world(pixel) - plate.to_world(straight.inverse() * point.other.cast<double>()),
          principal_stretch(jacobian)};
}

double limited(double logarithm) { return std::clamp(logarithm, -100.0, 100.0); }

ChannelTable<PlateLanding> plate_channels() {
  using Landing = const PlateLanding&;
  return {{{"displacement.x", "displacement.y", "displacement.z"}, [](Landing landing) { return landing.moved; }},
          {{"magnification.log"}, [](Landing landing) { return limited(landing.stretch.logs.sum()); }},
          {{"magnification.major", "magnification.minor", "magnification.angle"},
           [](Landing landing) -> Vector3d {
             return {limited(landing.stretch.logs[0]), limited(landing.stretch.logs[1]), landing.stretch.angle};
           }},
          {{"folds"}, [](Landing landing) { return landing.point.sheets; }},
          {{"length"}, [](Landing landing) { return landing.point.length; }},
          {{"error"}, [](Landing landing) { return std::min(landing.point.error, 100.0f); }}};
}

}  // namespace

Beam beam_on_plate(const Scene& scene) {
  if (!scene.description.light.fills_plate()) return scene.beam;
  // Blurred photons from beside the plate are seen, too.
  const PhotonDensity& density = scene.description.integrator.settings<PhotonDescription>().density;
  Plate plate = *scene.geometry.surfaces().plate;
  double beside = plate_margin * plate.size.maxCoeff();
  if (density.kind == PhotonDensityKind::gaussian)
    beside = std::max(beside, widest_gaussian * density.tau * plate.pixel_size().maxCoeff());
  plate.size += Vector2d::Constant(2 * beside);
  return widened_beam(scene.beam, plate.corners());
}

bool keeps_side_light(const Scene& scene) {
  const bool shows_box = scene.description.light.fills_plate() && !scene.geometry.has_cut();
  return scene.description.integrator.settings<PhotonDescription>().side_light.value_or(!shows_box);
}

void add_cost(const Statistics& more, Statistics& statistics) {
  statistics.seconds_tracing += more.seconds_tracing;
  statistics.seconds_density += more.seconds_density;
  statistics.ray_steps += more.ray_steps;
  statistics.tensor_samples += more.tensor_samples;
}

PlateLight light_on_plate(const Scene& scene, const Progress& progress, Job* job, const ShowLight& show) {
  PhotonSettings settings = photon_settings(scene, job);
  if (scene.description.integrator.settings<PhotonDescription>().density.kind != PhotonDensityKind::mesh) {
    if (show) settings.show = [&](PhotonDistribution so_far) { show(light_of(scene, std::move(so_far))); };
    return trace_photons(scene, settings, progress);
  }
  PlateLight light = mesh_light(scene, progress, job, show);
  const OutputDescription& output = scene.description.output;
  const bool is_shard = job && job->is_shard;  // Photons are then traced where shards are merged.
  if ((!output.wants("photons") && !output.wants("fluence")) || is_shard) return light;
  Render photons = trace_photons(scene, settings, progress).render;
  light.render.photons = std::move(photons.photons);
  light.render.grids = std::move(photons.grids);
  add_cost(photons.statistics, light.render.statistics);
  return light;
}

std::vector<std::string> plate_map_channels() { return channel_names(plate_channels()); }

Image plate_map(const FlowMap& map, const Scene& scene, const Progress& progress, Job* job) {
  const Plate& plate = *scene.geometry.surfaces().plate;
  FlowPicture picture;
  picture.resolution = plate.resolution;
  picture.straight = straight_starts(plate, scene.beam);
  const double place = reference_place(scene) * static_cast<double>(map.wavelengths - 1);
  const FlowView view(map, picture, {FlowRange{place, place}}, 1);
  const ChannelTable<PlateLanding> table = plate_channels();
  Image image(plate.resolution.x(), plate.resolution.y(), channel_names(table));
  Units tiles;
  tiles.count = static_cast<std::size_t>(view.tiles());
  tiles.round = FlowView::tiles_at_once;
  tiles.make = [&](std::size_t tile) {
    std::vector<FlowPoint> points;
    view.draw(static_cast<int>(tile), 1, 0, place, {}, points);
    const Eigen::AlignedBox2i box = view.pixels(static_cast<int>(tile));
    auto point = points.begin();
    for (int y = box.min().y(); y <= box.max().y(); ++y)
      for (int x = box.min().x(); x <= box.max().x(); ++x, ++point)
        if (point->end == RayEnd::plate)
          write_channels(table, landing_of(*point, {x + 0.5, y + 0.5}, plate, picture.straight), image.pixel(x, y));
  };
  tiles.copy = [&](std::size_t tile, Archive& archive) {
    const Eigen::AlignedBox2i box = view.pixels(static_cast<int>(tile));
    const std::size_t row = (static_cast<std::size_t>(box.sizes().x()) + 1) * image.channels.size() * sizeof(float);
    for (int y = box.min().y(); y <= box.max().y(); ++y) archive.copy(image.pixel(box.min().x(), y), row);
  };
  make_units(tiles, job, "drawing the map", progress);
  return image;
}

}  // namespace tensorray
