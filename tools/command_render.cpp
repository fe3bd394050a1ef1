#include <cstdio>
#include <fstream>
#include <memory>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <tbb/global_control.h>

#include "scenes/load_scene.h"
#include "scenes/read_scene.h"
#include "scenes/render.h"
#include "scenes/write_outputs.h"
#include "tools/commands.h"
#include "tools/progress_bar.h"

namespace tensorray {
namespace {

struct RenderOptions {
  std::string scene, statistics;
  std::vector<std::string> outputs, overrides;
  unsigned threads = 0;
  std::optional<std::uint64_t> seed;
  bool quiet = false;
};

bool ends_with(const std::string& text, const std::string& ending) {
  return text.size() >= ending.size() && text.compare(text.size() - ending.size(), ending.size(), ending) == 0;
}

/// The key under `output` that a file's ending belongs to.
std::string output_key(const std::string& file) {
  if (ends_with(file, ".spectral.exr")) return "spectral";
  if (ends_with(file, ".exr")) return "exr";
  if (ends_with(file, ".vdb") || ends_with(file, ".vtp")) return "photons";
  return "image";
}

/// Options as overrides of the scene: `-o` files, relative to the working folder, take the place of the scene's.
std::vector<std::string> overrides_of(const RenderOptions& options) {
  std::vector<std::string> overrides = options.overrides;
  if (!options.outputs.empty())
    for (const char* key : {"image", "exr", "spectral", "photons"})
      overrides.push_back(fmt::format("output.{}=null", key));
  for (const std::string& file : options.outputs)
    overrides.push_back(
        fmt::format("output.{}={}", output_key(file), nlohmann::json(std::filesystem::absolute(file).string()).dump()));
  if (options.seed) overrides.push_back(fmt::format("seed={}", *options.seed));
  return overrides;
}

double peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

/// Rays and power by end, over all channels.
nlohmann::json ends_json(const Statistics& statistics) {
  nlohmann::json rays, power;
  for (int end = 0; end < ray_end_count; ++end) {
    std::uint64_t count = 0;
    double sum = 0;
    for (std::size_t channel = 0; channel < statistics.ends.size(); ++channel) {
      count += statistics.ends[channel][end];
      sum += static_cast<double>(statistics.ends[channel][end]) * statistics.channel_power[channel];
    }
    rays[to_string(static_cast<RayEnd>(end))] = count;
    power[to_string(static_cast<RayEnd>(end))] = sum;
  }
  return {{"rays", rays}, {"power", power}};
}

nlohmann::json statistics_json(const Scene& scene, const Statistics& statistics, double seconds_writing, int threads) {
  nlohmann::json json = ends_json(statistics);
  std::uint64_t emitted = 0;
  for (const EndCounts& counts : statistics.ends)
    for (const std::uint64_t count : counts) emitted += count;
  const nlohmann::json& rays = json["rays"];
  json["photons"] = {
      {"positions", statistics.positions},
      {"emitted", emitted},
      {"deposited", rays["plate"]},
      {"missed", rays["missed"]},
      {"stopped",
       {{"obstacle", rays["obstacle"]}, {"step_limit", rays["step_limit"]}, {"degenerate", rays["degenerate"]}}}};
  json.erase("rays");
  json["ray_steps"] = statistics.ray_steps;
  json["tensor_samples"] = statistics.tensor_samples;
  json["field"] = {{"scale", scene.scale.scale},
                   {"non_finite_voxels", scene.non_finite},
                   {"defective_voxels", scene.eigenvalues.defective},
                   {"memory_bytes", scene.field.memory_bytes()}};
  json["seconds"] = {{"load", scene.seconds},
                     {"trace", statistics.seconds_tracing},
                     {"density", statistics.seconds_density},
                     {"color", statistics.seconds_color},
                     {"write", seconds_writing}};
  json["peak_memory_bytes"] = peak_memory_bytes();
  json["threads"] = threads;
  json["seed"] = scene.description.seed;
  return json;
}

void write_text(OutputFile& file, const std::string& text) {
  file.write([&](const std::filesystem::path& path) {
    std::ofstream stream(path, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw std::runtime_error("cannot write " + path.string() + ": the disk may be full");
  });
  file.commit();
}

void run(const RenderOptions& options, Progress& progress) {
  const unsigned threads = options.threads > 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);

  const SceneDescription description = read_scene(options.scene, overrides_of(options));
  OutputFiles outputs = open_outputs(description.output);
  std::optional<OutputFile> statistics_file;
  if (!options.statistics.empty()) statistics_file.emplace(options.statistics);

  const Scene scene = load_scene(description);
  if (!options.quiet)
    for (const std::string& note : scene.notes) fmt::print(stderr, "{}\n", note);
  const Render result = render(scene, progress);
  const auto start = std::chrono::steady_clock::now();
  const auto written = write_outputs(result, scene, std::move(outputs));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  if (statistics_file) {
    write_text(*statistics_file,
               statistics_json(scene, result.statistics, seconds, static_cast<int>(threads)).dump(2) + "\n");
  }
  if (!options.quiet)
    for (const auto& path : written) fmt::print("wrote {}\n", path.string());
}

}  // namespace

void add_render_command(CLI::App& app, Progress& progress) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* command = app.add_subcommand("render", "Render a scene file to pictures");
  command->add_option("SCENE", options->scene, "Scene file (JSON; `tensorray schema` tells its keys)")->required();
  command->add_option("-o,--output", options->outputs,
                      "Write only this; may be given several times. Its ending says what: .png .jpg .tif the displayed "
                      "picture, .exr scene-linear, .spectral.exr spectra, .vdb .vtp the photons");
  command->add_option("--set", options->overrides, "KEY=VALUE: change a value of the scene, as --set light.photons=1e5")
      ->allow_extra_args(false);
  command->add_option("--threads", options->threads, "Number of threads (all)")->check(CLI::Range(1, 4096));
  command->add_option("--seed", options->seed, "Seed of all random numbers (the scene's)");
  command->add_option("--stats", options->statistics, "Write statistics of the render to this JSON file");
  command->add_flag("-q,--quiet", options->quiet, "Print nothing but errors");
  command->callback([options, &progress] {
    const ProgressBar bar(progress, options->quiet);
    run(*options, progress);
  });
}

}  // namespace tensorray
