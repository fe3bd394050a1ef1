#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "renderer/spectra/spectrum.h"
#include "tools/commands/commands.h"
#include "tools/rendering/render_scene.h"

namespace tensorray {
namespace {

struct StretchOptions {
  std::string scene;
  SceneChanges changes;
  std::optional<double> length, wavelength;
  std::optional<int> resolution, pixels;
  RenderRun run;
};

/// The command is short for `render` with the method "stretch".
SceneChanges changes_of(const StretchOptions& options) {
  SceneChanges changes = options.changes;
  const auto set = [&changes](const char* key, const auto& value) {
    if (value) changes.overrides.push_back(fmt::format("integrator.stretch.{}={}", key, *value));
  };
  changes.overrides.emplace_back("integrator.type=stretch");
  set("length", options.length);
  set("wavelength", options.wavelength);
  set("resolution", options.resolution);
  set("pixels", options.pixels);
  return changes;
}

}  // namespace

void add_stretch_command(CLI::App& program, Progress& progress) {
  const auto options = std::make_shared<StretchOptions>();
  CLI::App* command = program.add_subcommand(
      "stretch",
      "Compute how fast a scene's field moves neighbouring rays apart (the finite-time Lyapunov exponent of "
      "light); short for `render` with the method stretch");
  command->add_option("SCENE", options->scene, "Scene file, of which field, bending, light and obstacles count")
      ->required();
  command
      ->add_option(
          "-o,--output", options->changes.outputs,
          "What to write, several if wanted: .vdb the float grid `stretch`, in the volume; .exr .png .jpg .tif "
          "a picture, of light that comes to the volume")
      ->required()
      ->allow_extra_args(false)
      ->type_name("FILE");
  command
      ->add_option("--length", options->length,
                   "How far light is followed, world units; default: the volume's depth along the light")
      ->check(CLI::PositiveNumber);
  command->add_option("--wavelength", options->wavelength, "Of the light, nm; default: 550, of RGB green")
      ->check(CLI::Range(observer_min, observer_max));
  command->add_option("--resolution", options->resolution, "Of the grid: voxels along the longest side (64)")
      ->check(CLI::Range(2, 4096));
  command->add_option("--pixels", options->pixels, "Of the picture: pixels along the longer side (512)")
      ->check(CLI::Range(1, 32768));
  command->add_option("--set", options->changes.overrides, "KEY=VALUE: change a value of the scene")
      ->allow_extra_args(false);
  command->add_option("--threads", options->run.threads, "Number of threads (all)")->check(CLI::Range(1, 4096));
  command->add_flag("-q,--quiet", options->run.quiet, "Print nothing but errors");
  command->callback(
      [options, &progress] { render_scene(options->scene, changes_of(*options), options->run, progress); });
}

}  // namespace tensorray
