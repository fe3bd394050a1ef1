#include "scenes/photons/plate_light.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/process/seconds.h"
#include "integrators/flow_drawing/caustic.h"
#include "integrators/photons/photon_distribution.h"
#include "renderer/film/image_distance.h"
#include "renderer/film/spectral_image.h"
#include "scenes/photons/photon_distribution_method.h"
#include "scenes/scene/fine_bands.h"

namespace tensorray {
namespace {

constexpr int most_refined_bands = 2048;
constexpr double least_tolerance = 1e-3;  // Pixels; landings are single precision.

FlowMap trace_map(const Scene& scene, double tolerance, Team* team, const Progress& progress) {
  FlowSettings settings;
  settings.most_starts = static_cast<std::size_t>(scene.description.light.photons);
  settings.tolerance = tolerance;
  const LightRange range = light_range(scene);
  settings.flexibilities = range.flexibilities;
  settings.range = range.is_range;
  settings.memory = scene.rays;
  settings.team = team;
  return trace_flow_map(scene.field, scene.geometry, scene.beam, scene.bending, settings, progress);
}

/// How finely light is spread over the way that it moves from wavelength to wavelength.
struct Sweep {
  BandStep bands = {2};
  double step = usual_step;  // Between the places where a triangle is drawn, pixels.
};

/// The bands that are drawn: each band of the scene is divided, so that light moves little from one to the next.
std::vector<CausticBand> bands_of(const Scene& scene, const FlowMap& map, const BandStep& step) {
  const Eigen::Matrix3d xyz_to_working = to_working(scene);
  const int channels = static_cast<int>(scene.bands.size());
  std::vector<CausticBand> bands;
  const double last = static_cast<double>(map.wavelengths - 1);
  for (const FineBand& fine : fine_bands(scene, band_count(map, channels, step))) {
    CausticBand band;
    band.sample = last * (fine.begin + fine.end) / 2;
    band.width = last * (fine.end - fine.begin);
    band.channel = fine.channel;
    band.weight = fine.weight;
    band.color = xyz_to_working * fine.band.xyz;
    bands.push_back(band);
  }
  return bands;
}

/// Power by channel and end, for a beam of irradiance 1.
std::vector<std::array<double, ray_end_count>> beam_power(const Scene& scene, const Caustic& caustic) {
  std::vector<std::array<double, ray_end_count>> power = caustic.power;
  for (std::size_t channel = 0; channel < power.size(); ++channel)
    for (double& each : power[channel]) each *= scene.channels[channel].power * area(scene.beam.aperture);
  return power;
}

PlateLight draw_map(const Scene& scene, double tolerance, const Sweep& sweep, Team* team, const Progress& progress) {
  Clock::time_point start = Clock::now();
  PlateLight light;
  light.map = trace_map(scene, tolerance, team, progress);
  const FlowMap& map = light.map;
  light.statistics.seconds_tracing = seconds_since(start);
  start = Clock::now();
  const CausticSettings settings{scene.bands.size(), scene.description.output.wants("spectral"), sweep.step, team};
  Caustic caustic =
      draw_caustic(map, *scene.geometry.surfaces().plate, bands_of(scene, map, sweep.bands), settings, progress);
  light.linear = color_image(caustic.color);
  light.irradiance = std::move(caustic.irradiance);
  light.statistics.seconds_density = seconds_since(start);
  light.statistics.positions = map.starts.size();
  light.statistics.ends = caustic.ends;
  light.statistics.power = beam_power(scene, caustic);
  light.statistics.ray_steps = map.ray_steps;
  light.statistics.tensor_samples = map.tensor_samples;
  if (team) collect_counts(*team, light.statistics);
  return light;
}

void add_cost(const Statistics& more, Statistics& statistics) {
  statistics.seconds_tracing += more.seconds_tracing;
  statistics.seconds_density += more.seconds_density;
  statistics.ray_steps += more.ray_steps;
  statistics.tensor_samples += more.tensor_samples;
}

/// Half the tolerance always has twice the bands.
Sweep refined_sweep(double tolerance) {
  return {{4 * tolerance, static_cast<int>(std::ceil(16 / tolerance)), most_refined_bands}, 4 * tolerance};
}

/// What is left of the error after a change, if further ones fall as the last two did: the sum of a geometric series.
/// Before there are two, and at the fastest, changes are taken to fall by half.
double rest_after(double change, double last_change) {
  const double ratio = last_change > 0 ? std::clamp(change / last_change, 0.5, 0.9) : 0.5;
  return change * ratio / (1 - ratio);
}

/// A number of process 0, which has the picture.
double of_first(Team* team, double number) {
  if (!team) return number;
  exchange_parts(*team, 1, 1, [&](std::size_t, PartBytes& bytes) { bytes.copy(&number, sizeof number); });
  return number;
}

/// Halves the tolerance and the steps of wavelengths until what is left of the error is less than `bound`.
PlateLight refine(const Scene& scene, double bound, Team* team, const Progress& progress) {
  std::string label;
  Progress labelled;  // Shows the error behind the phase.
  labelled.report = [&](const std::string& phase, std::uint64_t done, std::uint64_t total) {
    progress.update(phase + label, done, total);
    labelled.cancelled = progress.cancelled.load();
  };
  double tolerance = 1, last_change = 0;
  PlateLight light = draw_map(scene, tolerance, refined_sweep(tolerance), team, labelled);
  for (;;) {
    tolerance /= 2;
    PlateLight finer = draw_map(scene, tolerance, refined_sweep(tolerance), team, labelled);
    const double change = of_first(team, relative_distance(light.linear, finer.linear));
    const double error = rest_after(change, last_change);
    last_change = change;
    finer.statistics.error = error;
    add_cost(light.statistics, finer.statistics);
    light = std::move(finer);
    label = fmt::format(" (error {:.2g}%)", 100 * error);
    if (error <= bound) return light;
    if (!light.map.is_complete || tolerance < least_tolerance) {
      light.warnings.push_back(
          fmt::format("the picture's error is {:.2g}%, not {:.2g}%: {}", 100 * error, 100 * bound,
                      light.map.is_complete ? "positions are single precision" : "raise `light.photons`"));
      return light;
    }
  }
}

PlateLight draw_light(const Scene& scene, Team* team, const Progress& progress) {
  const PhotonDensity& density = scene.description.integrator.settings<PhotonDescription>().density;
  if (density.error) return refine(scene, *density.error, team, progress);
  PlateLight light = draw_map(scene, density.tolerance, {}, team, progress);
  if (!light.map.is_complete)
    light.warnings.push_back(
        "the light on the plate is coarser than `integrator.density.tolerance` asks: raise `light.photons`");
  return light;
}

/// Whether photons are collected as red, green and blue. Up to three bands need no more planes, and cost less.
bool is_collected_in_color(const Scene& scene) {
  return !scene.description.output.wants("spectral") && scene.bands.size() > 3;
}

PhotonSettings photon_settings(const Scene& scene, Work* work) {
  const SceneDescription& description = scene.description;
  PhotonSettings settings;
  settings.bending = scene.bending;
  settings.work = work;
  settings.photons = description.light.photons;
  settings.pattern = description.light.pattern;
  settings.channels_per_photon = description.bending.rgb ? 0 : description.light.wavelengths_per_photon;
  settings.seed = description.seed;
  settings.density = estimator_of(description.integrator.settings<PhotonDescription>().density);
  settings.keep_photons = description.output.wants("photons");
  if (description.output.wants("fluence"))
    settings.fluence = description.output.fluence_bands ? FluenceKind::bands : FluenceKind::all_light;
  if (is_collected_in_color(scene))
    for (const Band& band : scene.bands) settings.colors.push_back(to_working(scene) * band.xyz);
  return settings;
}

PlateLight trace_photons(const Scene& scene, const Progress& progress, Work* work = nullptr) {
  PhotonDistribution traced = distribute_photons(scene.field, scene.geometry, scene.beam, scene.channels,
                                                 photon_settings(scene, work), progress);
  PlateLight light;
  light.linear = is_collected_in_color(scene) ? color_image(traced.irradiance)
                                              : linear_image(traced.irradiance, scene.bands, to_working(scene));
  light.irradiance = std::move(traced.irradiance);
  light.photons = std::move(traced.photons);
  light.fluence = std::move(traced.fluence);
  Statistics& statistics = light.statistics;
  statistics.positions = traced.positions;
  statistics.ends = std::move(traced.ends);
  for (const LightChannel& channel : scene.channels)
    statistics.channel_power.push_back(channel.power * traced.ray_area);
  statistics.ray_steps = traced.ray_steps;
  statistics.tensor_samples = traced.tensor_samples;
  statistics.seconds_tracing = traced.seconds_tracing;
  statistics.seconds_density = traced.seconds_density;
  return light;
}

}  // namespace

PlateLight light_on_plate(const Scene& scene, const Progress& progress, RenderJob* job) {
  if (scene.description.integrator.settings<PhotonDescription>().density.kind != PhotonDensityKind::mesh)
    return trace_photons(scene, progress, job ? &job->work : nullptr);
  Team* const team = job ? job->team : nullptr;
  PlateLight light = draw_light(scene, team, progress);
  const OutputDescription& output = scene.description.output;
  if ((!output.wants("photons") && !output.wants("fluence")) || !has_all(team)) return light;
  PlateLight photons = trace_photons(scene, progress);
  light.photons = std::move(photons.photons);
  light.fluence = std::move(photons.fluence);
  add_cost(photons.statistics, light.statistics);
  return light;
}

}  // namespace tensorray
