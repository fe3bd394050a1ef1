#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/process/seconds.h"
#include "integrators/photon_distribution/photon_distribution_method.h"
#include "integrators/photon_distribution/plate_light.h"
#include "renderer/film/spectral_image.h"
#include "scenes/scene/scene.h"
#include "tracing/flow_drawing/caustic.h"

namespace tensorray {
namespace {

constexpr int max_refined_bands = 2048;
constexpr double min_tolerance = 1e-3;  // Pixels; landings are single precision.

/// A picture that is made, and who makes it.
struct MeshJob {
  const Scene& scene;
  Job* const job;  // Null: nobody else wants anything of it.
  const ShowLight& show;
  const Beam beam = beam_on_plate(scene);
  Ranks* const ranks = job ? job->ranks : nullptr;
  const bool is_shard = job && job->is_shard;

  bool is_shown() const { return job && is_root(ranks) && job->picture_wanted.exchange(false); }
};

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
std::vector<std::array<double, ray_end_count>> landed_power(const Scene& scene, double area, const Caustic& caustic) {
  std::vector<std::array<double, ray_end_count>> power = caustic.power;
  for (std::size_t channel = 0; channel < power.size(); ++channel)
    for (double& each : power[channel]) each *= scene.channels[channel].power * area;
  return power;
}

PlateLight draw(const MeshJob& job, FlowMap map, const Sweep& sweep, Ranks* ranks, const Progress& progress) {
  const auto start = Clock::now();
  const Scene& scene = job.scene;
  PlateLight light;
  light.map = std::move(map);
  const CausticSettings settings{scene.bands.size(), scene.description.output.wants("spectral"), sweep.step, ranks};
  Caustic caustic = draw_caustic(light.map, *scene.geometry.surfaces().plate, bands_of(scene, light.map, sweep.bands),
                                 settings, progress);
  light.render.linear = color_image(caustic.color);
  light.irradiance = std::move(caustic.irradiance);
  Statistics& statistics = light.render.statistics;
  statistics.seconds_density = seconds_since(start);
  statistics.positions = light.map.starts.size();
  statistics.emitted.assign(scene.channels.size(), light.map.starts.size());
  statistics.ends = caustic.ends;
  const double beam_area = area(job.beam.aperture);
  statistics.power = landed_power(scene, beam_area, caustic);
  for (const LightChannel& channel : scene.channels) statistics.beam_power += channel.power * beam_area;
  statistics.ray_steps = light.map.ray_steps;
  statistics.tensor_samples = light.map.tensor_samples;
  gather_counts(ranks, statistics);
  return light;
}

FlowMap trace(const MeshJob& job, double tolerance, const Progress& progress) {
  const Scene& scene = job.scene;
  FlowSettings settings;
  settings.max_starts = static_cast<std::size_t>(scene.description.light.photons);
  settings.tolerance = tolerance;
  const LightRange range = light_range(scene);
  settings.flexibilities = range.flexibilities;
  settings.range = range.is_range;
  settings.side_light = keeps_side_light(scene);
  settings.job = job.job;
  settings.is_kept = true;
  if (job.show)
    settings.show = [&](const std::function<FlowMap()>& so_far) {
      if (job.is_shown()) job.show(draw(job, so_far(), {}, nullptr, progress));
    };
  return trace_flow_map(scene.field, scene.geometry, job.beam, scene.bending, settings, progress);
}

PlateLight trace_and_draw(const MeshJob& job, double tolerance, const Sweep& sweep, const Progress& progress) {
  const auto start = Clock::now();
  FlowMap map = trace(job, tolerance, progress);
  const double seconds = seconds_since(start);
  PlateLight light = draw(job, std::move(map), sweep, job.ranks, progress);
  light.render.statistics.seconds_tracing = seconds;
  return light;
}

/// Half the tolerance always has twice the bands.
Sweep refined_sweep(double tolerance) {
  return {{4 * tolerance, static_cast<int>(std::ceil(16 / tolerance)), max_refined_bands}, 4 * tolerance};
}

/// What is left of the error after a change, if further ones fall as the last two did: the sum of a geometric series.
/// Before there are two, and at the fastest, changes are taken to fall by half.
double rest_after(double change, double last_change) {
  const double ratio = last_change > 0 ? std::clamp(change / last_change, 0.5, 0.9) : 0.5;
  return change * ratio / (1 - ratio);
}

/// Halves the tolerance and the steps of wavelengths until what is left of the error is less than `bound`.
PlateLight refine(const MeshJob& job, double bound, const Progress& progress) {
  std::string label;
  Progress labelled;  // Shows the error behind the phase.
  labelled.report = [&](const std::string& phase, std::uint64_t done, std::uint64_t total) {
    progress.update(phase + label, done, total);
    labelled.cancelled = progress.cancelled.load();
  };
  double tolerance = 1, last_change = 0;
  PlateLight light = trace_and_draw(job, tolerance, refined_sweep(tolerance), labelled);
  for (;;) {
    tolerance /= 2;
    PlateLight finer = trace_and_draw(job, tolerance, refined_sweep(tolerance), labelled);
    const double change = broadcast(job.ranks, relative_distance(light.render.linear, finer.render.linear));
    const double error = rest_after(change, last_change);
    last_change = change;
    finer.render.statistics.error = error;
    add_cost(light.render.statistics, finer.render.statistics);
    light = std::move(finer);
    label = fmt::format(" (error {:.2g}%)", 100 * error);
    if (error <= bound) return light;
    if (!light.map.is_complete || tolerance < min_tolerance) {
      light.render.warnings.push_back(
          fmt::format("the picture's error is {:.2g}%, not {:.2g}%: {}", 100 * error, 100 * bound,
                      light.map.is_complete ? "positions are single precision" : "raise `light.photons`"));
      return light;
    }
  }
}

}  // namespace

PlateLight mesh_light(const Scene& scene, const Progress& progress, Job* job, const ShowLight& show) {
  const PhotonDensity& density = scene.description.integrator.settings<PhotonDescription>().density;
  const MeshJob mesh{scene, job, show};
  PlateLight light;
  if (density.error) {
    light = refine(mesh, *density.error, progress);
  } else if (mesh.is_shard) {
    trace(mesh, density.tolerance, progress);
  } else {
    light = trace_and_draw(mesh, density.tolerance, {}, progress);
    if (!light.map.is_complete)
      light.render.warnings.push_back(
          "the light on the plate is coarser than `integrator.density.tolerance` asks: raise `light.photons`");
  }
  return mesh.is_shard ? PlateLight() : light;
}

}  // namespace tensorray
