#include "tools/rendering/render_scene.h"

#include <cmath>
#include <future>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/process/seconds.h"
#include "base/text/path_text.h"
#include "base/text/text.h"
#include "renderer/images/image.h"
#include "scenes/description/check_scene.h"
#include "scenes/keys/json_reader.h"
#include "scenes/scene/render.h"
#include "scenes/source/overrides.h"
#include "tools/command_line/run_and_report.h"
#include "tools/command_line/tell.h"
#include "tools/command_line/threads.h"
#include "tools/rendering/checkpoint.h"
#include "tools/rendering/rank_scene.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

/// Loads a scene, with the field of `loaded` if that has the same.
Scene load(const SceneDescription& description, std::optional<Scene>& loaded, const Progress& progress) {
  std::optional<LoadedField> field = field_of(loaded, description);
  if (!field) loaded.reset();  // Its memory is needed.
  return load_scene(description, progress, std::move(field));
}

/// Other programs' numbers of frames mean that frames are wanted. (# may be part of a name.)
void refuse_number_signs(const SceneDescription& description, const RenderRun& run) {
  std::vector<std::filesystem::path> files = files_of(description, run);
  if (!run.scene_copy.empty()) files.push_back(run.scene_copy);
  for (const std::filesystem::path& file : files)
    if (has_foreign_number_sign(file.filename().string()))
      throw std::invalid_argument(printable(file.string()) +
                                  ": has the number of a frame; give --frames, as --frames 7");
}

/// Writes the outputs of what there is so far.
void write_so_far(Render render, const Scene& scene, const Job& job) {
  render.metadata["tensorray:done"] = fmt::format("{:.4f}", job.fraction.load());
  OutputFiles files = open_outputs(scene.description.output);
  write_outputs(render, scene, files);
  commit_outputs(std::move(files));
}

std::string run_statistics(const Scene& scene, const Statistics& statistics, double seconds, const RenderRun& run) {
  std::string text = statistics_json(scene, statistics, seconds, static_cast<int>(running_threads()));
  if (!run.ranks) return text;
  auto json = nlohmann::ordered_json::parse(text);
  json["ranks"] = {{"count", run.ranks->count()}};
  return json.dump(2) + "\n";
}

/// Changes that fix what was chosen: the direction of the light, if the scene leaves it open, and the strength.
std::vector<std::string> choices_for(const Scene& scene) {
  const Json light = parse_value(scene.description.text).value("light", Json::object());
  const Eigen::Vector3d V = scene.description.turn().transpose() * *scene.description.light.direction;
  std::vector<std::string> changes;
  if (light.value("direction", Json()) == "auto")
    changes.push_back(fmt::format("light.direction=[{},{},{}]", V.x(), V.y(), V.z()));
  const Strength strength = scene.method->strength(scene);
  if (!strength.is_fixed) changes.push_back(fmt::format("{}.{}={}", strength.section, strength.key, strength.value));
  return changes;
}

/// The scene's text, with what was chosen for it, so that it looks the same with a field that has changed.
std::string scene_as_rendered(const Scene& scene) {
  Json json = parse_value(scene.description.text);
  for (const std::string& choice : choices_for(scene)) apply_override(json, choice);
  return json.dump(2) + "\n";
}

/// Renders what is left of the job. @throw Interrupted if it is cancelled, but some of its work is kept: with the
/// picture so far, if there is one.
Render render_or_keep(const Scene& scene, RenderJob& job, Checkpoint& checkpoint, const Progress& progress) {
  const auto kept = [&] {
    return checkpoint.write() ? "the same command continues from " + checkpoint.file().string() : std::string();
  };
  Render result;
  try {
    result = render(scene, progress, &job);
  } catch (const Cancelled&) {
    const std::string what = kept();
    if (what.empty()) throw;
    throw Interrupted("interrupted; " + what);
  }
  if (!job.stopping) return result;
  const std::string what = kept();
  if (!job.is_shard) write_so_far(std::move(result), scene, job);
  throw Interrupted(fmt::format("interrupted at {:.0f}%; {}", std::floor(100 * job.fraction),
                                what.empty() ? "nothing was kept" : what));
}

/// Writes all files. What was rendered is kept if they cannot be written.
void write_or_keep(const Scene& scene, const Render& result, Checkpoint& checkpoint, OutputFiles files,
                   const RenderRun& run) {
  const auto start = Clock::now();
  try {
    if (run.keeping.shard)
      files.at(shard_key).write([&](const std::filesystem::path& path) { write_work(path, checkpoint.shard()); });
    write_outputs(result, scene, files);
    if (!run.statistics.empty())
      files.at(statistics_key).write_text(run_statistics(scene, result.statistics, seconds_since(start), run));
    if (!run.scene_copy.empty()) files.at(scene_key).write_text(scene_as_rendered(scene));
    commit_outputs(std::move(files));
  } catch (const std::exception&) {  // The disk may be full.
    if (checkpoint.write())
      tell({"the work is kept: the same command continues from " + checkpoint.file().string()}, run.quiet);
    throw;
  }
}

/// Files of a run.
struct RunFiles {
  OutputFiles outputs;
  std::filesystem::path checkpoint;  ///< Empty: none is written.
  std::filesystem::path earlier;     ///< Of the results that it begins with; empty: there are none.
};

/// Renders the job and writes all files. @throw DamagedArchive if the checkpoint cannot be used, and need not.
void complete(const Scene& scene, RenderJob& job, RunFiles files, const RenderRun& run, Progress& progress) {
  std::optional<ProgressBar> bar(std::in_place, progress, run.quiet);
  const std::future<void> images =  // Errors come with the first image.
      std::async(std::launch::async, prepare_images, written_by(scene.description, run));
  job.interval = files.checkpoint.empty() ? 0 : run.keeping.interval;
  Checkpoint checkpoint(scene, job, files.checkpoint, run.keeping, progress);
  job.show = [&](Render picture) {
    if (run.keeping.shard) return;
    try {
      write_so_far(std::move(picture), scene, job);
    } catch (const std::exception& error) {
      tell({fmt::format("warning: no picture: {}", escaped(error.what()))}, false);
    }
  };
  try {
    const Render result = render_or_keep(scene, job, checkpoint, progress);
    bar.reset();  // Erase the bar before the notes are printed.
    tell(result.notes, run.quiet);
    for (const std::string& warning : result.warnings) tell({"warning: " + warning}, run.quiet);
    write_or_keep(scene, result, checkpoint, std::move(files.outputs), run);
  } catch (const DamagedArchive& error) {
    const bool may_begin_anew = files.earlier == files.checkpoint && !run.keeping.resume && !run.ranks;
    if (files.earlier.empty() || may_begin_anew) throw;
    fail(files.earlier, error.what());
  }
  checkpoint.remove();
  for (const std::filesystem::path& each : written_by(scene.description, run))
    if (!run.quiet) tell_made("wrote " + each.string());
}

/// Renders what the checkpoint, if there is one, has not.
void continue_or_begin(const Scene& scene, RunFiles files, const RenderRun& run, Progress& progress) {
  EarlierResults earlier = read_earlier(files.checkpoint, run, scene);
  if (run.ranks) agree(*run.ranks, scene, earlier.results);
  files.earlier = earlier.file;
  RenderJob job(run.keeping.shard.value_or(WorkPart{}), std::move(earlier.results));
  job.is_shard = run.keeping.shard.has_value();
  job.ranks = run.ranks;
  complete(scene, job, std::move(files), run, progress);
}

}  // namespace

void bound_memory_of(const RenderRun& run, const SceneDescription& description) {
  if (run.memory > 0)
    bound_memory(run.memory, std::filesystem::absolute(written_by(description, run).front()).parent_path());
}

Scene render_to_files(const SceneDescription& description, const RenderRun& run, std::optional<Scene> loaded,
                      Progress& progress) {
  // First: a folder that cannot be written is named for the picture.
  RunFiles files{open_files(description, run), checkpoint_file(description, run.keeping), {}};
  const std::filesystem::path checkpoint = files.checkpoint;
  std::optional<ProgressBar> bar(std::in_place, progress, run.quiet);
  if (run.ranks) send_scene(*run.ranks, description, run);
  Scene scene = load(description, loaded, progress);
  bar.reset();
  tell(scene.notes, run.quiet);
  try {
    continue_or_begin(scene, std::move(files), run, progress);
  } catch (const DamagedArchive& error) {  // Its header is right, but what follows is not what these outputs need.
    if (checkpoint.empty() || run.ranks || run.keeping.resume) throw;
    set_aside(checkpoint, checkpoint.string() + ": " + error.what(), run.quiet);
    continue_or_begin(scene, {open_files(description, run), checkpoint, {}}, run, progress);
  }
  return scene;
}

std::vector<std::string> render_scene(const std::filesystem::path& scene_file, const SceneChanges& changes,
                                      const RenderRun& run, Progress& progress) {
  const Threads threads(run.threads);
  set_image_threads(static_cast<int>(running_threads()));
  if (!is_root(run.ranks)) {
    render_with_root(*run.ranks, run, progress);
    return {};
  }
  const SceneDescription description = read_scene(scene_file, changes);
  refuse_number_signs(description, run);
  bound_memory_of(run, description);
  if (is_field_file(scene_file) || !changes.imported.empty()) tell({"scene: " + description.text}, run.quiet);
  return choices_for(render_to_files(description, run, {}, progress));
}

void merge_shards(const SceneDescription& description, WorkFile shards, const RenderRun& run, Progress& progress) {
  const Threads threads(run.threads);
  set_image_threads(static_cast<int>(running_threads()));
  RunFiles files{open_files(description, run), {}, "a shard"};
  const Scene scene = load_scene(description, progress);
  const std::string other = difference(shards.origin, origin_of(scene));
  if (!other.empty())
    throw SceneError(
        printable(fmt::format("{}: has changed since the shards were made: {}; undo the change, or make them "
                              "again",
                              description.path.string(), other)));
  RenderJob job(shards.part, std::move(shards.results));
  complete(scene, job, std::move(files), run, progress);
}

OutputFiles open_files(const SceneDescription& description, const RenderRun& run) {
  require_same_folder(description.path, run.scene_copy);
  const std::vector<NamedFile> more{
      {run.statistics, statistics_key}, {run.scene_copy, scene_key}, {run.keeping.shard_file, shard_key}};
  std::vector<NamedFile> all = more;
  all.push_back({checkpoint_of(description, run.keeping), "the checkpoint"});
  std::vector<NamedFile> read = run.inputs;
  read.push_back({run.keeping.light, "--light"});
  check_files(description, all, read);
  OutputFiles files;
  if (!run.keeping.shard) files = open_outputs(description.output);
  for (const NamedFile& file : more)
    if (!file.path.empty()) files.emplace(file.name, OutputFile(file.path));
  return files;
}

RenderRun at_frame(RenderRun run, int frame) {
  run.statistics = numbered(run.statistics.string(), frame);
  run.keeping.shard_file = numbered(run.keeping.shard_file.string(), frame);
  run.keeping.light = numbered(run.keeping.light.string(), frame);
  return run;
}

std::vector<std::filesystem::path> written_by(const SceneDescription& description, const RenderRun& run) {
  std::vector<std::filesystem::path> files;
  if (run.keeping.shard) return {run.keeping.shard_file};
  for (const auto& [key, path] : description.output.files) files.push_back(path);
  return files;
}

std::vector<std::filesystem::path> files_of(const SceneDescription& description, const RenderRun& run) {
  std::vector<std::filesystem::path> files = written_by(description, run);
  if (!run.statistics.empty()) files.push_back(run.statistics);
  return files;
}

std::filesystem::path checkpoint_of(const SceneDescription& description, const RunKeeping& keeping) {
  const auto beside = [](const std::filesystem::path& file) { return with_suffix(file, ".checkpoint"); };
  if (!keeping.is_on) return {};
  if (keeping.shard) return is_device(keeping.shard_file) ? std::filesystem::path() : beside(keeping.shard_file);
  const auto& files = description.output.files;
  const auto picture = files.find("image");
  if (picture != files.end() && !is_device(picture->second)) return beside(picture->second);
  for (const auto& [key, path] : files)
    if (!is_device(path)) return beside(path);
  return {};
}

}  // namespace tensorray
