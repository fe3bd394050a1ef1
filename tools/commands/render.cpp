#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/files/output_file.h"
#include "base/text/text.h"
#include "integrators/methods/read_scene.h"
#include "scenes/source/overrides.h"
#include "tools/command_line/imported_field.h"
#include "tools/command_line/run_and_report.h"
#include "tools/commands/commands.h"
#include "tools/ranks/ranks.h"
#include "tools/rendering/render_scene.h"
#include "volumes/files/tensor_files.h"

namespace tensorray {
namespace {

struct RenderOptions {
  std::vector<std::filesystem::path> files;  // A scene, a field, or files of one import.
  SceneChanges changes;
  std::optional<std::uint64_t> seed;
  std::string error;
  ImportChoices import;
  std::string frames, shard;
  bool split = false;
  RenderRun run;
};

/// The kinds of outputs and their endings, from the table of methods.
std::string output_help() {
  std::string text =
      "Write this instead of the scene's outputs; one of each kind may be given. The ending says the kind";
  for (const auto& method : default_scene().integrator.methods) {
    text += fmt::format("; {}:", method->name());
    for (const Output& kind : method->outputs())
      text += fmt::format(" {} ({})", joined(kind.option_endings(), " "), kind.key);
  }
  return text;
}

/// "3/16" as a part of work; takes its file from the outputs. @throw std::invalid_argument.
void take_shard(const std::string& text, SceneChanges& changes, RunKeeping& keeping) {
  const std::size_t slash = text.find('/');
  std::size_t number = 0, count = 0;
  const bool is_read = slash != std::string::npos && CLI::detail::lexical_cast(text.substr(0, slash), number) &&
                       CLI::detail::lexical_cast(text.substr(slash + 1), count);
  if (!is_read || number < 1 || number > count || count > max_shards)
    throw std::invalid_argument(
        fmt::format("--shard {}: give number and count, as 3/16; numbers begin with 1, and there may be {}",
                    printable(text), max_shards));
  if (changes.outputs.size() != 1)
    throw std::invalid_argument("--shard: name one file for the shard, as -o part" + std::to_string(number) + ".shard");
  keeping.shard = WorkPart{number - 1, count};
  keeping.shard_file = changes.outputs.front();
  changes.outputs.clear();
}

SceneChanges changes_of(const RenderOptions& options) {
  SceneChanges changes = options.changes;
  if (options.seed) changes.overrides.push_back(fmt::format("seed={}", *options.seed));
  if (!options.error.empty())
    changes.overrides.push_back(fmt::format("integrator.density.error={}", part_of(options.error, "--until-error")));
  return changes;
}

/// The end of a run that keeps going. @throw std::runtime_error if frames failed.
void report_failed(const std::vector<int>& failed) {
  if (failed.empty()) return;
  throw std::runtime_error(fmt::format("{} {} failed: {}; render again with --frames {}", failed.size(),
                                       failed.size() == 1 ? "frame" : "frames", fmt::join(failed, ", "),
                                       fmt::join(failed, ",")));
}

/// What renders the noise of the field alone, to NAME.noise.png of NAME.png.
SceneChanges noise_changes(SceneChanges changes, const SceneDescription& scene) {
  changes.overrides.emplace_back("field.noise=true");
  changes.outputs.clear();
  for (const Output& kind : scene.integrator.method().outputs())
    if (scene.output.files.count(kind.key) > 0) {
      std::string file = scene.output.files.at(kind.key).string();
      changes.outputs.emplace_back(file.insert(file.size() - kind.ending_of(file).size(), ".noise"));
    }
  return changes;
}

/// The noise of several levels is not known. @throw std::invalid_argument.
void require_one_level(const FieldDescription& field, const GivenField& given) {
  if (!field.generate &&
      !open_tensor_vdb(field.file_to_read(), field.name, field.derive, field.components).finer.empty())
    throw std::invalid_argument(printable(given.name().string()) +
                                ": --split: the field has several levels; import it with --levels 1");
}

/// Renders a scene, and beside its pictures those of the field's noise alone, in the same light, if --split is given.
/// What can be wrong with either is found before the work begins.
void render_and_split(const GivenField& given, const SceneChanges& changes, const RenderRun& run, bool split,
                      Progress& progress) {
  if (split && (changes.outputs.empty() || run.keeping.shard || run.ranks))
    throw std::invalid_argument("--split: name the pictures with -o; it is not for shards, frames and ranks");
  const auto description = [&](const SceneChanges& each) { return read_scene(given.name(), each); };
  SceneChanges noise;
  RenderRun of_noise = run;
  if (split || given.is_imported()) open_files(description(changes), run);
  if (split) {
    noise = noise_changes(changes, description(changes));
    for (const std::filesystem::path& file : files_of(description(changes), run))
      of_noise.inputs.push_back({file, "a picture of the field"});
    of_noise.statistics = of_noise.scene_copy = of_noise.keeping.light = "";
    of_noise.keeping.resume = false;
    open_files(description(noise), of_noise);
  }
  given.import(run.quiet, run.memory);
  if (split) require_one_level(description(changes).field, given);
  const std::vector<std::string> chosen = render_scene(given.name(), changes, run, progress);
  if (!split) return;
  noise.overrides.insert(noise.overrides.end(), chosen.begin(), chosen.end());
  render_scene(given.name(), noise, of_noise, progress);
}

/// The name of pictures, without its ending: beside a file, without its known ending; of a folder, its own name.
std::string picture_name(std::filesystem::path file) {
  if (std::filesystem::is_directory(file)) {
    if (!file.has_filename()) file = file.parent_path();  // "case/"
    const bool is_dots = file.filename() == "." || file.filename() == "..";
    return (is_dots ? std::filesystem::weakly_canonical(file).filename() : file).string();
  }
  if (lower_case_ending(file) == ".gz") file.replace_extension();
  return file.replace_extension().string();
}

/// Renders other programs' files. Its pictures are named after the first.
void render_import(const GivenField& given, SceneChanges changes, const RenderOptions& options, Progress& progress) {
  if (!options.frames.empty()) throw std::invalid_argument("--frames: import the files first, with `tensorray import`");
  if (!options.shard.empty() || options.run.keeping.resume)
    throw std::invalid_argument("--shard, --resume: import the file first, with `tensorray import`");
  if (!options.run.scene_copy.empty()) given.require_stays();
  const std::string name = picture_name(given.name());
  if (changes.outputs.empty()) changes.outputs = {name + ".png", name + ".exr"};
  changes.imported = given.imported();
  RenderRun run = options.run;
  run.inputs = given.inputs();
  run.keeping.is_on = false;  // The field does not stay.
  render_and_split(given, changes, run, options.split, progress);
}

/// @param ranks  Null: this process is alone. @return frames that failed, where the run keeps going.
std::vector<int> render(const RenderOptions& options, Ranks* ranks, Progress& progress) {
  if (!is_root(ranks)) broadcast(ranks, true);  // The root has found nothing wrong with the command line.
  SceneChanges changes = changes_of(options);
  const GivenField given(options.files, options.import);
  if (given.is_imported()) {
    if (ranks) throw std::invalid_argument("mpirun: import the file first, with `tensorray import`");
    render_import(given, changes, options, progress);
    return {};
  }
  RenderRun run = options.run;
  run.ranks = ranks;
  if (!options.shard.empty()) take_shard(options.shard, changes, run.keeping);
  if (!options.frames.empty() && !run.scene_copy.empty())
    throw std::invalid_argument("--save-scene: not for several frames");
  if (is_root(ranks)) broadcast(ranks, true);
  if (options.frames.empty()) {
    render_and_split(given, changes, run, options.split, progress);
    return {};
  }
  if (options.split) throw std::invalid_argument("--split: not for several frames");
  return render_frames(given.name(), changes, parse_frames(options.frames), run, progress);
}

/// The root says what is wrong for all; other ranks, what is wrong with them alone.
std::vector<int> render_with_others(const RenderOptions& options, JoinedRanks& ranks, Progress& progress) {
  try {
    return render(options, &ranks, progress);
  } catch (const Cancelled&) {
    if (is_root(&ranks)) throw;
    throw CLI::RuntimeError(130);  // Without a word.
  } catch (const std::exception& error) {
    if (is_root(&ranks)) throw;
    throw std::runtime_error(fmt::format("rank {}: {}", ranks.rank(), error.what()));
  }
}

void render_alone_or_with_others(const RenderOptions& options, Progress& progress) {
  const std::unique_ptr<JoinedRanks> ranks = join_ranks(progress);
  if (!ranks) return report_failed(render(options, nullptr, progress));
  const std::vector<int> failed = render_with_others(options, *ranks, progress);
  ranks->finish();
  if (is_root(ranks.get())) report_failed(failed);
}

}  // namespace

void add_render_command(CLI::App& program, Progress& progress) {
  const auto options = std::make_shared<RenderOptions>();
  CLI::App* command = program.add_subcommand("render", "Render a scene file, or a field, to pictures");
  command
      ->add_option("SCENE", options->files,
                   "Scene file (JSON; `tensorray schema` prints its keys); or a field, as .vdb or any file that "
                   "`tensorray import` reads: the light that it bends, with all defaults")
      ->required();
  command->add_option("-o,--output", options->changes.outputs, output_help())->allow_extra_args(false);
  command
      ->add_option(
          "--set", options->changes.overrides,
          "KEY=VALUE: change a value of the scene, as --set light.photons=1e5; files are relative to the scene")
      ->allow_extra_args(false);
  command->add_option_function<std::string>(
      "--method", [options](const auto& name) { options->changes.overrides.push_back("integrator.type=" + name); },
      "The method that makes the picture, as polariscope: instead of the scene's `integrator.type`");
  command->add_option("--threads", options->run.threads, "Number of threads (all)")->check(CLI::Range(1, 4096));
  command->add_option("--seed", options->seed, "Seed of all random numbers (the scene's)");
  command->add_option("--until-error", options->error,
                      "photon_distribution: refine until the picture's relative error is below this, as 1%");
  command->add_option("--stats", options->run.statistics, "Write statistics of the render to this JSON file");
  command->add_option("--save-scene", options->run.scene_copy, "Write the scene, with its changes, to this JSON file");
  command->add_flag(
      "--split", options->split,
      "Of measured fields: render the noise of the field alone, too, in the same light, to NAME.noise.png "
      "of NAME.png: what both pictures show is noise");
  CLI::Option* frames =
      command->add_option("--frames", options->frames,
                          "Render these frames, as 1-240, 1-240x2 or 1,3,7-9: # in names of files is the "
                          "frame's number (flow.####.vdb, or flow.%04d.vdb, flow.$F4.vdb), and "
                          "numbers of the scene may have keyframes");
  command
      ->add_flag("--keep-going", options->run.keep_going,
                 "Of frames: if one fails, render those that follow, and name those that failed at the end")
      ->needs(frames);
  command->add_flag("--skip-existing", options->run.skip_existing, "Leave out frames whose files exist")->needs(frames);
  command
      ->add_option("--checkpoint", options->run.keeping.interval,
                   "Seconds after which the work is kept again, in PICTURE.checkpoint (60); 0: only when interrupted")
      ->check(CLI::Range(0.0, 1e9));
  command->add_flag("--resume", options->run.keeping.resume,
                    "Be sure to continue: it is an error if there is no checkpoint, or one of another render");
  command->add_option(
      "--shard", options->shard,
      "K/N: do part K of N of the work, from 1 to N, and write it to the file of -o, for `tensorray merge`");
  command->add_option("--light", options->run.keeping.light,
                      "A shard (the first) or a checkpoint of this render: the light that it has made before the tiles "
                      "is used, and not made again");
  command
      ->add_option(
          "--memory", options->run.memory,
          "Keep the field in a file on the disk of the pictures, of which the system has in memory what is free, and "
          "make it in so much memory, as 8G or 500M")
      ->transform(CLI::AsSizeValue(false))
      ->option_text("SIZE");
  command->add_flag("--watch", options->run.keeping.watch, "Keep the pictures up to date while they are rendered");
  add_field_options(*command, options->import, options->changes.overrides);
  command->add_flag("-q,--quiet", options->run.quiet, "Print nothing but errors");
  command->callback([options, &progress] { render_alone_or_with_others(*options, progress); });
}

}  // namespace tensorray
