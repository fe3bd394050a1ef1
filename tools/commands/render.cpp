#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/text.h"
#include "scenes/pipeline/methods.h"
#include "tools/commands/commands.h"
#include "tools/commands/render_scene.h"

namespace tensorray {
namespace {

struct RenderOptions {
  std::string scene;
  SceneChanges changes;
  std::optional<std::uint64_t> seed;
  std::string error;
  RenderRun run;
};

/// The kinds of outputs and their endings, from the table of methods.
std::string output_help() {
  std::string text =
      "Write this instead of the scene's outputs; one of each kind may be given. The ending says the kind";
  for (const auto& method : default_scene().integrator.methods) {
    text += fmt::format("; {}:", method->name());
    for (const Output& kind : method->outputs()) {
      const std::vector<std::string> endings =
          kind.option_ending ? std::vector<std::string>{kind.option_ending} : kind.endings;
      text += fmt::format(" {} ({})", joined(endings, " "), kind.key);
    }
  }
  return text;
}

/// "1%" or "0.01" as a number. @throw std::invalid_argument if it is none.
double parse_part(const std::string& text) {
  const bool percent = !text.empty() && text.back() == '%';
  double value = 0;
  if (!CLI::detail::lexical_cast(percent ? text.substr(0, text.size() - 1) : text, value) || !(value > 0))
    throw std::invalid_argument("--until-error " + text + ": give a part greater than 0, such as 1% or 0.01");
  return percent ? value / 100 : value;
}

}  // namespace

void add_render_command(CLI::App& program, Progress& progress) {
  const auto options = std::make_shared<RenderOptions>();
  CLI::App* command = program.add_subcommand("render", "Render a scene file, or a field, to pictures");
  command
      ->add_option("SCENE", options->scene,
                   "Scene file (JSON; `tensorray schema` prints its keys), or a field (.vdb): the light that it bends, "
                   "with all defaults")
      ->required();
  command->add_option("-o,--output", options->changes.outputs, output_help());
  command
      ->add_option(
          "--set", options->changes.overrides,
          "KEY=VALUE: change a value of the scene, as --set light.photons=1e5; files are relative to the scene")
      ->allow_extra_args(false);
  command->add_option("--threads", options->run.threads, "Number of threads (all)")->check(CLI::Range(1, 4096));
  command->add_option("--seed", options->seed, "Seed of all random numbers (the scene's)");
  command->add_option("--until-error", options->error,
                      "photon_distribution: refine until the picture's relative error is below this, as 1%");
  command->add_option("--stats", options->run.statistics, "Write statistics of the render to this JSON file");
  command->add_option("--save-scene", options->run.scene_copy, "Write the scene, with its changes, to this JSON file");
  command->add_flag("-q,--quiet", options->run.quiet, "Print nothing but errors");
  command->callback([options, &progress] {
    SceneChanges changes = options->changes;
    if (options->seed) changes.overrides.push_back(fmt::format("seed={}", *options->seed));
    if (!options->error.empty())
      changes.overrides.push_back(fmt::format("integrator.density.error={}", parse_part(options->error)));
    render_scene(options->scene, changes, options->run, progress);
  });
}

}  // namespace tensorray
