#include "scenes/outputs/write_outputs.h"

#include <cstdint>
#include <vector>

#include <sys/resource.h>
#include <tbb/parallel_for_each.h>

#include "base/text/path_text.h"

namespace tensorray {
namespace {

/// Counts or powers: what was emitted, and where it ended.
template <class Number>
Json balance(Number emitted, const std::array<Number, ray_end_count>& ends) {
  const auto of = [&](RayEnd end) { return ends[static_cast<int>(end)]; };
  Json stopped;
  for (const RayEnd end : {RayEnd::obstacle, RayEnd::step_limit, RayEnd::degenerate}) stopped[to_string(end)] = of(end);
  Json json{{"emitted", emitted}, {"deposited", of(RayEnd::plate)}, {"missed", of(RayEnd::missed)}};
  if (of(RayEnd::side) != 0) json["side"] = of(RayEnd::side);
  json["stopped"] = stopped;
  return json;
}

/// Photons of the method "scene".
Json photon_counts(const PhotonCounts& counts) {
  const auto of = [&](PhotonEnd end) { return counts.ends[static_cast<std::size_t>(end)]; };
  return {{"emitted", counts.emitted},
          {"before", of(PhotonEnd::before)},
          {"landed", of(PhotonEnd::landed)},
          {"escaped", of(PhotonEnd::escaped)},
          {"stopped", of(PhotonEnd::stopped)}};
}

void add_scene_method(const SceneMethodStatistics& work, Json& json) {
  PhotonCounts all{};
  Json passes = Json::array();
  for (const PhotonCounts& counts : work.photons) {
    all += counts;
    passes.push_back(photon_counts(counts));
  }
  json["bent_rays"] = json["photons"];
  json["samples"] = work.samples;
  json["photons"] = photon_counts(all);
  json["photons"]["passes"] = passes;
  json.erase("positions");
  json.erase("channels");
}

std::uint64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024 * static_cast<std::uint64_t>(usage.ru_maxrss);
}

}  // namespace

OutputFiles open_outputs(const OutputDescription& output) {
  OutputFiles files;
  for (const auto& [key, path] : output.files) files.emplace(key, OutputFile(path));
  return files;
}

void write_outputs(const Render& render, const Scene& scene, OutputFiles& files) {
  std::vector<Output> wanted;
  for (const Output& output : scene.description.integrator.method().outputs())
    if (files.count(output.key) > 0) wanted.push_back(output);
  tbb::parallel_for_each(wanted, [&](const Output& output) {  // Most of the time one thread compresses a file.
    files.at(output.key).write([&](const std::filesystem::path& path) { output.write(path, scene, render); });
  });
}

void commit_outputs(OutputFiles files) {
  std::vector<OutputFile> complete;
  for (auto& [key, file] : files) complete.push_back(std::move(file));
  commit_all(complete);
}

std::string statistics_json(const Scene& scene, const Statistics& statistics, double seconds_writing, int threads) {
  EndCounts rays{};
  std::uint64_t emitted = 0;
  std::array<double, ray_end_count> power{};
  double emitted_power = statistics.beam_power;
  Json channels = Json::array();
  const bool has_power = !statistics.channel_power.empty() || !statistics.power.empty();
  for (std::size_t channel = 0; channel < statistics.ends.size(); ++channel) {
    for (int end = 0; end < ray_end_count; ++end) {
      const std::uint64_t count = statistics.ends[channel][end];
      rays[end] += count;
      if (!statistics.channel_power.empty())
        power[end] += static_cast<double>(count) * statistics.channel_power[channel];
      if (!statistics.power.empty()) power[end] += statistics.power[channel][end];
    }
    emitted += statistics.emitted[channel];
    if (!statistics.channel_power.empty())
      emitted_power += static_cast<double>(statistics.emitted[channel]) * statistics.channel_power[channel];
    channels.push_back(
        {{"wavelength", scene.channels[channel].wavelength}, {"flexibility", scene.channels[channel].flexibility}});
    if (!statistics.channel_power.empty()) channels.back()["ray_power"] = statistics.channel_power[channel];
    channels.back()["rays"] = balance(statistics.emitted[channel], statistics.ends[channel]);
  }
  const double seconds = scene.seconds + statistics.seconds_tracing + statistics.seconds_density +
                         statistics.seconds_drawing + statistics.seconds_color + seconds_writing;
  Json json = {{"version", TENSORRAY_VERSION},
               {"scene", text_of_path(scene.description.path)},
               {"seed", scene.description.seed},
               {"threads", threads},
               {"positions", statistics.positions},
               {"photons", balance(emitted, rays)},
               {"ray_steps", statistics.ray_steps},
               {"tensor_samples", statistics.tensor_samples},
               {"field",
                {{"scale", scene.scale.scale},
                 {"non_finite_voxels", scene.non_finite},
                 {"defective_voxels", scene.eigenvalues.defective},
                 {"memory_bytes", scene.field.memory_bytes()}}},
               {"seconds",
                {{"load", scene.seconds},
                 {"trace", statistics.seconds_tracing},
                 {"density", statistics.seconds_density},
                 {"draw", statistics.seconds_drawing},
                 {"color", statistics.seconds_color},
                 {"write", seconds_writing},
                 {"total", seconds}}},
               {"peak_memory_bytes", peak_memory_bytes()},
               {"channels", channels}};
  if (statistics.error) json["error"] = *statistics.error;
  if (has_power) json["power"] = balance(emitted_power, power);
  if (statistics.scene_method) add_scene_method(*statistics.scene_method, json);
  return json.dump(2) + "\n";
}

}  // namespace tensorray
