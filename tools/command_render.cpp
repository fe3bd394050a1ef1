#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "renderer/images/image.h"
#include "scenes/load_scene.h"
#include "scenes/read_scene.h"
#include "scenes/render.h"
#include "scenes/write_outputs.h"
#include "tools/commands.h"
#include "tools/progress_bar.h"
#include "tools/statistics_json.h"
#include "tools/tell.h"

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

/// The key under `output` that a file's ending belongs to. @param draws_paths  Whether the scene is path tracing.
std::string output_key(const std::string& file, bool draws_paths) {
  if (ends_with(file, ".spectral.exr")) return "spectral";
  if (ends_with(file, ".exr")) return "exr";
  if (ends_with(file, ".fluence.vdb")) return "fluence";
  if (ends_with(file, ".vdb") || (ends_with(file, ".vtp") && !draws_paths)) return "photons";
  if (ends_with(file, ".vtp") || ends_with(file, ".tck")) return "paths";
  if (ends_with(file, ".ply") || ends_with(file, ".obj")) return "tubes";
  return "image";
}

/// Options as overrides of the scene: `-o` files, relative to the working folder, take the place of the scene's.
/// @throw CLI::ValidationError if two are of one kind.
std::vector<std::string> overrides_of(const RenderOptions& options) {
  std::vector<std::string> overrides = options.overrides;
  if (options.seed) overrides.push_back(fmt::format("seed={}", *options.seed));
  if (options.outputs.empty()) return overrides;
  for (const char* key : {"image", "exr", "spectral", "photons", "paths", "tubes", "fluence"})
    overrides.push_back(fmt::format("output.{}=null", key));
  const bool draws_paths = read_scene(options.scene, overrides).integrator.type == IntegratorType::path_tracing;
  std::map<std::string, std::string> files;
  for (const std::string& file : options.outputs) {
    const auto [other, is_new] = files.emplace(output_key(file, draws_paths), file);
    if (!is_new)
      throw CLI::ValidationError("-o", fmt::format("{} and {} are of one kind; give one of them", other->second, file));
    overrides.push_back(
        fmt::format("output.{}={}", other->first, nlohmann::json(std::filesystem::absolute(file).string()).dump()));
  }
  return overrides;
}

/// The statistics' file must not take the place of the scene or of a picture.
void check_statistics_path(const std::filesystem::path& path, const SceneDescription& scene) {
  const auto identity = [](const std::filesystem::path& file) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(file));
  };
  const OutputDescription& output = scene.output;
  for (const auto& other :
       {scene.path, scene.field.file, output.image, output.exr, output.spectral, output.photons, output.paths,
        output.tubes, output.fluence, scene.integrator.paths.paths, scene.integrator.paths.seeds.file})
    if (!other.empty() && identity(other) == identity(path) && !std::filesystem::is_other(path))
      throw CLI::ValidationError("--stats", path.string() + " is another file of this render; choose another name");
}

/// What a picture does not show of itself.
std::vector<std::string> warnings_of(const Scene& scene, const Statistics& statistics) {
  std::uint64_t emitted = 0, deposited = 0, limited = 0;
  for (const EndCounts& counts : statistics.ends) {
    for (const std::uint64_t count : counts) emitted += count;
    deposited += counts[static_cast<int>(RayEnd::plate)];
    limited += counts[static_cast<int>(RayEnd::step_limit)];
  }
  std::vector<std::string> warnings;
  if (deposited == 0 && !scene.paths)
    warnings.push_back(scene.lens ? "warning: no ray found the image; look at `receiver` and `integrator.image_plane`"
                                  : "warning: no light reached the plate; look at `receiver` and `light`");
  if (100 * limited > emitted)
    warnings.push_back(
        fmt::format("warning: {:.0f}% of the rays were given up after `bending.max_steps` steps; raise it",
                    100.0 * static_cast<double>(limited) / static_cast<double>(emitted)));
  return warnings;
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
  set_image_threads(static_cast<int>(threads));

  const SceneDescription description = read_scene(options.scene, overrides_of(options));
  OutputFiles outputs = open_outputs(description.output);
  std::optional<OutputFile> statistics_file;
  if (!options.statistics.empty()) {
    check_statistics_path(options.statistics, description);
    statistics_file.emplace(options.statistics);
  }

  std::optional<ProgressBar> bar(std::in_place, progress, options.quiet);
  const Scene scene = load_scene(description, progress);
  tell(scene.notes, options.quiet);
  const Render result = render(scene, progress);
  bar.reset();  // Erased, so that what is printed next stands alone.
  tell(warnings_of(scene, result.statistics), options.quiet);

  const auto start = std::chrono::steady_clock::now();
  const auto written = write_outputs(result, scene, std::move(outputs));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (statistics_file)
    write_text(*statistics_file, statistics_json(scene, result.statistics, seconds, static_cast<int>(threads)));
  if (!options.quiet)
    for (const auto& path : written) fmt::print("wrote {}\n", path.string());
}

}  // namespace

void add_render_command(CLI::App& app, Progress& progress) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* command = app.add_subcommand("render", "Render a scene file to pictures");
  command->add_option("SCENE", options->scene, "Scene file (JSON; `tensorray schema` tells its keys)")->required();
  command->add_option(
      "-o,--output", options->outputs,
      "Write this instead of the scene's outputs; one of each kind may be given. The ending says the kind: "
      ".png .jpg .tif the displayed picture, .exr scene-linear, .spectral.exr spectra, .vdb .vtp photons, .fluence.vdb "
      "the light inside the volume, of path tracing .vtp .tck paths, .ply .obj tubes");
  command
      ->add_option(
          "--set", options->overrides,
          "KEY=VALUE: change a value of the scene, as --set light.photons=1e5; files are relative to the scene")
      ->allow_extra_args(false);
  command->add_option("--threads", options->threads, "Number of threads (all)")->check(CLI::Range(1, 4096));
  command->add_option("--seed", options->seed, "Seed of all random numbers (the scene's)");
  command->add_option("--stats", options->statistics, "Write statistics of the render to this JSON file");
  command->add_flag("-q,--quiet", options->quiet, "Print nothing but errors");
  command->callback([options, &progress] { run(*options, progress); });
}

}  // namespace tensorray
