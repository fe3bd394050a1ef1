#include "integrators/photon_distribution/plate_light.h"

#include <utility>

#include "integrators/photon_distribution/photon_distribution.h"
#include "integrators/photon_distribution/photon_distribution_method.h"
#include "renderer/film/spectral_image.h"

namespace tensorray {
namespace {

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
  settings.side_light = description.integrator.settings<PhotonDescription>().side_light;
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
      distribute_photons(scene.field, scene.geometry, scene.beam, scene.channels, settings, progress);
  const bool has_light = !settings.job || (is_root(settings.job->ranks) && !settings.job->is_shard);
  return has_light ? light_of(scene, std::move(traced)) : PlateLight();
}

}  // namespace

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

}  // namespace tensorray
