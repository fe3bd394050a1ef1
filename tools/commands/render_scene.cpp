#include "tools/commands/render_scene.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <future>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "base/seconds.h"
#include "renderer/images/image.h"
#include "scenes/description/run_files.h"
#include "scenes/jobs/origin.h"
#include "scenes/keys/frames.h"
#include "scenes/keys/json_reader.h"
#include "scenes/outputs/statistics_json.h"
#include "scenes/outputs/write_outputs.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "tools/command_line/progress_bar.h"
#include "tools/command_line/run_and_report.h"
#include "tools/command_line/tell.h"
#include "tools/commands/work_keeper.h"

namespace tensorray {
namespace {

/// Keys among the outputs, because all files are committed together.
const std::string statistics_key = "--stats", scene_key = "--save-scene", shard_key = "--shard";
constexpr double watch_interval = 5;  // Seconds.

void write_text(OutputFile& file, const std::string& text) {
  file.write([&](const std::filesystem::path& path) {
    std::ofstream stream(path, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw std::runtime_error("cannot write " + path.string() + ": the disk may be full");
  });
}

/// Paths in a scene are relative to its folder. @throw SceneError if the copy is in another one.
void check_scene_copy(const std::filesystem::path& scene, const std::filesystem::path& copy) {
  if (copy.empty() || is_field_file(scene)) return;  // The scene of a field has no relative paths.
  const auto folder = [](const std::filesystem::path& file) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(file).parent_path());
  };
  if (folder(scene) != folder(copy))
    throw SceneError(printable(fmt::format("{} {}: must be in the folder of {}, to which paths in it are relative",
                                           scene_key, copy.string(), scene.string())));
}

OutputFiles open_files(const SceneDescription& description, const RenderRun& run) {
  check_scene_copy(description.path, run.scene_copy);
  const std::vector<NamedFile> more{
      {run.statistics, statistics_key}, {run.scene_copy, scene_key}, {run.keeping.shard_file, shard_key}};
  check_files(description, more);
  OutputFiles files;
  if (!run.keeping.shard) files = open_outputs(description.output);
  for (const NamedFile& file : more)
    if (!file.path.empty()) files.emplace(file.name, OutputFile(file.path));
  return files;
}

RenderRun at_frame(RenderRun run, int frame) {
  run.statistics = numbered(run.statistics.string(), frame);
  run.keeping.shard_file = numbered(run.keeping.shard_file.string(), frame);
  return run;
}

/// The files of the result.
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

bool is_device(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  return std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
}

unsigned threads_of(const RenderRun& run) {
  return run.threads > 0 ? run.threads : std::max(1u, std::thread::hardware_concurrency());
}

/// What does not change while a field stays the same.
Json field_of(const SceneDescription& description) {
  Json field = parse_value(description.text)["field"];
  for (const char* key : {"scale", "bounds"}) field.erase(key);
  return field;
}

/// Loads a scene; from `loaded`, if that has the same field.
Scene load(const SceneDescription& description, std::optional<Scene>& loaded, const Progress& progress) {
  if (!loaded || field_of(loaded->description) != field_of(description)) {
    loaded.reset();  // Its memory is needed.
    return load_scene(description, progress);
  }
  return reload_scene(*loaded, description, progress);
}

/// Where a run keeps its work; empty: nowhere.
std::filesystem::path checkpoint_of(const SceneDescription& description, const RunKeeping& keeping) {
  const auto beside = [](const std::filesystem::path& file) {
    return std::filesystem::path(file.string() + ".checkpoint");
  };
  if (!keeping.is_on) return {};
  if (keeping.shard) return beside(keeping.shard_file);
  const auto& files = description.output.files;
  const auto picture = files.find("image");
  if (picture != files.end() && !is_device(picture->second)) return beside(picture->second);
  for (const auto& [key, path] : files)
    if (!is_device(path)) return beside(path);
  return {};
}

KeepSettings keep_settings(const SceneDescription& description, const RenderRun& run) {
  KeepSettings settings;
  settings.file = checkpoint_of(description, run.keeping);
  settings.interval = run.keeping.interval;
  settings.watch = run.keeping.watch ? watch_interval : 0;
  settings.quiet = run.quiet;
  const Method& method = description.integrator.method();
  if (run.keeping.shard && !method.is_divided())
    throw SceneError(
        fmt::format("--shard: the work of {} is one piece; divide a sequence by --frames instead", method.name()));
  if (!run.keeping.resume && !settings.file.empty() && std::filesystem::exists(settings.file))
    throw SceneError(
        printable(fmt::format("{}: is the checkpoint of a render that did not end; continue it with --resume, "
                              "or remove the file",
                              settings.file.string())));
  return settings;
}

/// The units of the checkpoint, if the run continues one. @throw SceneError if it is that of another render.
std::vector<WorkUnit> kept_units(const std::filesystem::path& file, const RenderRun& run, const Scene& scene) {
  if (!run.keeping.resume || file.empty() || !std::filesystem::exists(file)) return {};
  WorkFile kept = read_work(file);
  const WorkPart part = run.keeping.shard.value_or(WorkPart{});
  std::string other = difference(kept.origin, origin_of(scene));
  if (kept.part.index != part.index || kept.part.count != part.count)
    other = fmt::format("it is part {} of {}", kept.part.index + 1, kept.part.count);
  if (!other.empty())
    throw SceneError(printable(fmt::format(
        "{}: is the checkpoint of another render: {}; undo the change, or remove the file", file.string(), other)));
  return std::move(kept.units);
}

/// Writes the outputs of what there is so far.
void write_so_far(Render render, const Scene& scene, const Work& work) {
  render.metadata["tensorray:done"] = fmt::format("{:.4f}", work.fraction.load());
  OutputFiles files = open_outputs(scene.description.output);
  write_outputs(render, scene, files);
  commit_outputs(std::move(files));
}

/// Ends an interrupted run: with a checkpoint, and with the picture so far.
[[noreturn]] void end_early(Render render, const Scene& scene, const Work& work, WorkKeeper& keeper,
                            const RenderRun& run, const std::filesystem::path& checkpoint) {
  const bool is_kept = keeper.write();
  if (!run.keeping.shard) write_so_far(std::move(render), scene, work);
  const std::string kept =
      is_kept ? fmt::format("--resume continues from {}", checkpoint.string()) : "nothing was kept";
  throw Interrupted(fmt::format("interrupted at {:.0f}%; {}", std::floor(100 * work.fraction), kept));
}

/// @throw Interrupted if the render is cancelled, but some of its work is kept.
Render render_or_keep(const Scene& scene, const Progress& progress, RenderJob& job, WorkKeeper& keeper,
                      const std::filesystem::path& checkpoint) {
  try {
    return render(scene, progress, &job);
  } catch (const Cancelled&) {
    if (!keeper.write()) throw;
    throw Interrupted(fmt::format("interrupted; --resume continues from {}", checkpoint.string()));
  }
}

/// Renders what is left of the work of `job`, and writes all files.
void complete(const Scene& scene, RenderJob& job, OutputFiles files, const KeepSettings& keep, const RenderRun& run,
              Progress& progress) {
  std::optional<ProgressBar> bar(std::in_place, progress, run.quiet);
  job.show = [&](Render picture) {
    if (run.keeping.shard) return;
    try {
      write_so_far(std::move(picture), scene, job.work);
    } catch (const std::runtime_error& error) {
      tell({fmt::format("warning: no picture: {}", error.what())}, false);
    }
  };
  WorkKeeper keeper(scene, job.work, keep);
  Render result = render_or_keep(scene, progress, job, keeper, keep.file);
  bar.reset();  // Erase the bar before the notes are printed.
  if (job.work.stopping) end_early(std::move(result), scene, job.work, keeper, run, keep.file);
  for (const std::string& warning : result.warnings) tell({"warning: " + warning}, run.quiet);
  const auto start = Clock::now();
  try {
    if (run.keeping.shard) write_work(run.keeping.shard_file, keeper.work_file());
    files.erase(shard_key);
    write_outputs(result, scene, files);
    if (!run.statistics.empty())
      write_text(files.at(statistics_key),
                 statistics_json(scene, result.statistics, seconds_since(start), static_cast<int>(threads_of(run))));
    if (!run.scene_copy.empty()) write_text(files.at(scene_key), parse_value(scene.description.text).dump(2) + "\n");
    commit_outputs(std::move(files));
  } catch (const std::runtime_error&) {  // The disk may be full.
    if (keeper.write()) tell({"the work is kept: --resume continues from " + keep.file.string()}, run.quiet);
    throw;
  }
  keeper.remove();
}

/// Renders a scene to its files. @return the loaded scene.
Scene render_to_files(const SceneDescription& description, const RenderRun& run, std::optional<Scene> loaded,
                      Progress& progress) {
  const KeepSettings keep = keep_settings(description, run);
  OutputFiles files = open_files(description, run);
  std::optional<ProgressBar> bar(std::in_place, progress, run.quiet);
  Scene scene = load(description, loaded, progress);
  bar.reset();
  tell(scene.notes, run.quiet);
  const std::future<void> images = std::async(std::launch::async, prepare_images);  // Errors come with the first image.
  RenderJob job{Work(run.keeping.shard.value_or(WorkPart{}), kept_units(keep.file, run, scene)), {}};
  complete(scene, job, std::move(files), keep, run, progress);
  for (const std::filesystem::path& file : written_by(description, run))
    if (!run.quiet) fmt::print("wrote {}\n", file.string());
  return scene;
}

/// @throw SceneError if two frames have a file in common.
void check_names(const std::filesystem::path& scene_file, SceneChanges changes, const std::vector<int>& frames,
                 const RenderRun& run) {
  if (frames.size() < 2) return;
  std::vector<std::vector<std::filesystem::path>> names;
  for (const int frame : {frames[0], frames[1]}) {
    changes.frame = frame;
    names.push_back(files_of(read_scene(scene_file, changes), at_frame(run, frame)));
  }
  for (const std::filesystem::path& name : names[0])
    if (std::find(names[1].begin(), names[1].end(), name) != names[1].end())
      throw SceneError(
          printable(fmt::format("{}: each frame would replace it; count frames by # in its name, as in "
                                "picture.####.png",
                                name.string())));
}

}  // namespace

void render_scene(const std::filesystem::path& scene_file, const SceneChanges& changes, const RenderRun& run,
                  Progress& progress) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads_of(run));
  set_image_threads(static_cast<int>(threads_of(run)));
  const SceneDescription description = read_scene(scene_file, changes);
  if (is_field_file(scene_file)) tell({"scene: " + description.text}, run.quiet);
  render_to_files(description, run, {}, progress);
}

void render_frames(const std::filesystem::path& scene_file, SceneChanges changes, const std::vector<int>& frames,
                   bool skip_existing, const RenderRun& run, Progress& progress) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads_of(run));
  set_image_threads(static_cast<int>(threads_of(run)));
  check_names(scene_file, changes, frames, run);
  changes.frame = frames.front();
  const SceneDescription first = read_scene(scene_file, changes);
  std::optional<Scene> loaded;
  if (!first.field.scale || !first.light.direction) loaded = load_scene(first, progress);
  const std::optional<double> scale = loaded ? loaded->scale.scale : first.field.scale;
  const std::optional<Eigen::Vector3d> direction = loaded ? loaded->description.light.direction : first.light.direction;
  for (const int frame : frames) {
    changes.frame = frame;
    SceneDescription description = read_scene(scene_file, changes);
    if (!description.field.scale) description.field.scale = scale;
    if (!description.light.direction) description.light.direction = direction;
    const RenderRun with_number = at_frame(run, frame);
    const std::vector<std::filesystem::path> files = files_of(description, with_number);
    const auto exists = [](const std::filesystem::path& file) { return std::filesystem::exists(file); };
    const std::filesystem::path checkpoint = checkpoint_of(description, with_number.keeping);
    const bool is_done = std::all_of(files.begin(), files.end(), exists) && (checkpoint.empty() || !exists(checkpoint));
    if (skip_existing && is_done) continue;
    tell({fmt::format("frame {}", frame)}, run.quiet);
    Scene rendered = render_to_files(description, with_number, std::move(loaded), progress);
    loaded.emplace(std::move(rendered));
  }
}

void write_merged(const SceneDescription& description, const WorkFile& work, const RenderRun& run, Progress& progress) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads_of(run));
  set_image_threads(static_cast<int>(threads_of(run)));
  OutputFiles files = open_files(description, run);
  const Scene scene = load_scene(description, progress);
  const std::string other = difference(work.origin, origin_of(scene));
  if (!other.empty())
    throw SceneError(
        printable(fmt::format("{}: has changed since the shards were made: {}; undo the change, or make them "
                              "again",
                              description.path.string(), other)));
  RenderJob job{Work({}, work.units), {}};
  complete(scene, job, std::move(files), {}, run, progress);
  for (const std::filesystem::path& file : written_by(description, run))
    if (!run.quiet) fmt::print("wrote {}\n", file.string());
}

}  // namespace tensorray
