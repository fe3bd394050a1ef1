#include "tools/rendering/render_scene.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <future>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/process/seconds.h"
#include "base/text/numbered_name.h"
#include "base/text/path_text.h"
#include "base/text/text.h"
#include "renderer/images/image.h"
#include "scenes/jobs/origin.h"
#include "scenes/keys/json_reader.h"
#include "scenes/outputs/statistics_json.h"
#include "scenes/outputs/write_outputs.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "scenes/source/frames.h"
#include "tools/command_line/progress_bar.h"
#include "tools/command_line/run_and_report.h"
#include "tools/command_line/tell.h"
#include "tools/command_line/threads.h"
#include "tools/ranks/follower.h"
#include "tools/ranks/leader.h"
#include "tools/rendering/checkpoint_writer.h"
#include "tools/rendering/kept_work.h"
#include "tools/rendering/run_outputs.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

constexpr double watch_interval = 5;  // Seconds.

/// A name that cannot be looked at does not exist; opening the file says why.
bool is_there(const std::filesystem::path& file) {
  std::error_code none;
  return std::filesystem::exists(file, none);
}

/// Loads a scene, with the field of `loaded` if that has the same.
Scene load(const SceneDescription& description, std::optional<Scene>& loaded, const Progress& progress) {
  std::optional<LoadedField> field = field_of(loaded, description);
  if (!field) loaded.reset();  // Its memory is needed.
  return load_scene(description, progress, std::move(field));
}

KeepSettings keep_settings(const SceneDescription& description, const RenderRun& run) {
  KeepSettings settings;
  settings.file = checkpoint_of(description, run.keeping);
  settings.interval = run.keeping.interval;
  settings.watch = run.keeping.watch ? watch_interval : 0;
  settings.quiet = run.quiet;
  const Method& method = description.integrator.method();
  if (run.keeping.shard && !method.has_shards())
    throw SceneError(
        fmt::format("--shard: the work of {} is one piece; divide a sequence by --frames instead", method.name()));
  if (!run.keeping.resume && !settings.file.empty() && is_there(settings.file))
    throw SceneError(
        printable(fmt::format("{}: is the checkpoint of a render that did not end; continue it with --resume, "
                              "or remove the file",
                              settings.file.string())));
  return settings;
}

/// Writes the outputs of what there is so far.
void write_so_far(Render render, const Scene& scene, const Work& work) {
  render.metadata["tensorray:done"] = fmt::format("{:.4f}", work.fraction.load());
  OutputFiles files = open_outputs(scene.description.output);
  write_outputs(render, scene, files);
  commit_outputs(std::move(files));
}

/// Ends an interrupted run: with a checkpoint, and with the picture so far.
[[noreturn]] void end_early(Render render, const Scene& scene, const Work& work, CheckpointWriter& keeper,
                            const RenderRun& run, const std::filesystem::path& checkpoint) {
  const bool is_kept = keeper.write();
  if (!run.keeping.shard) write_so_far(std::move(render), scene, work);
  const std::string kept =
      is_kept ? fmt::format("--resume continues from {}", checkpoint.string()) : "nothing was kept";
  throw Interrupted(fmt::format("interrupted at {:.0f}%; {}", std::floor(100 * work.fraction), kept));
}

/// @throw Interrupted if the render is cancelled, but some of its work is kept.
Render render_or_keep(const Scene& scene, const Progress& progress, RenderJob& job, CheckpointWriter& keeper,
                      const std::filesystem::path& checkpoint) {
  try {
    return render(scene, progress, &job);
  } catch (const Cancelled&) {
    if (!keeper.write()) throw;
    throw Interrupted(fmt::format("interrupted; --resume continues from {}", checkpoint.string()));
  }
}

/// What a shard's file has: what all shards make before their units is in the first one alone.
WorkFile shard_of(WorkFile work) {
  if (work.part.index > 0) work.before = {};
  return work;
}

/// While it lives, all ranks do units of the work, or its steps together, if the method has such. They get what the
/// work belongs to, as `merge` does from shards.
class SharedWork {
 public:
  SharedWork(Leader* leader, const Scene& scene, RenderJob& job, unsigned threads) : job_(job) {
    const Method& method = scene.description.integrator.method();
    if (!leader || !method.has_shards()) return;
    leader_ = leader;
    Json outputs = Json::object();
    for (const auto& [kind, file] : scene.description.output.files)
      outputs[kind] = text_of_path(std::filesystem::absolute(file));
    const Json order = {{"origin", origin_of(scene)},
                        {"outputs", outputs},
                        {"scene_file", text_of_path(std::filesystem::absolute(scene.description.path))},
                        {"part", {job.work.part().index, job.work.part().count}},
                        {"is_shard", job.work.is_shard}};
    job.team =
        method.is_divided() ? &leader_->share(order.dump(), job.work, threads) : &leader_->share_steps(order.dump());
  }
  ~SharedWork() {
    if (leader_) leader_->end();
    job_.team = nullptr;
  }
  SharedWork(const SharedWork&) = delete;
  SharedWork& operator=(const SharedWork&) = delete;

 private:
  Leader* leader_ = nullptr;
  RenderJob& job_;
};

std::string run_statistics(const Scene& scene, const Statistics& statistics, double seconds, const RenderRun& run) {
  std::string text = statistics_json(scene, statistics, seconds, static_cast<int>(running_threads()));
  if (!run.leader) return text;
  const RankTraffic traffic = run.leader->traffic();
  auto json = nlohmann::ordered_json::parse(text);
  json["ranks"] = {{"count", traffic.units.size()},
                   {"units", traffic.units},
                   {"messages", traffic.messages},
                   {"bytes_sent", traffic.bytes_sent},
                   {"bytes_received", traffic.bytes_received}};
  return json.dump(2) + "\n";
}

/// Renders what is left of the work of `job`, and writes all files.
void complete(const Scene& scene, RenderJob& job, OutputFiles files, const KeepSettings& keep, const RenderRun& run,
              Progress& progress) {
  std::optional<ProgressBar> bar(std::in_place, progress, run.quiet);
  job.work.is_shard = run.keeping.shard.has_value();
  job.before.interval = job.work.interval = keep.file.empty() ? 0 : keep.interval;
  const SharedWork shared(run.leader, scene, job, running_threads());
  CheckpointWriter keeper(scene, job, keep);
  job.show = [&](Render picture) {
    if (run.keeping.shard) return;
    try {
      write_so_far(std::move(picture), scene, job.work);
    } catch (const std::exception& error) {
      tell({fmt::format("warning: no picture: {}", escaped(error.what()))}, false);
    }
  };
  Render result = render_or_keep(scene, progress, job, keeper, keep.file);
  bar.reset();  // Erase the bar before the notes are printed.
  if (job.work.stopping) end_early(std::move(result), scene, job.work, keeper, run, keep.file);
  for (const std::string& warning : result.warnings) tell({"warning: " + warning}, run.quiet);
  const auto start = Clock::now();
  try {
    if (run.keeping.shard)
      files.at(shard_key).write(
          [&](const std::filesystem::path& path) { write_work(path, shard_of(keeper.work_file())); });
    write_outputs(result, scene, files);
    if (!run.statistics.empty())
      write_text(files.at(statistics_key), run_statistics(scene, result.statistics, seconds_since(start), run));
    if (!run.scene_copy.empty()) write_text(files.at(scene_key), parse_value(scene.description.text).dump(2) + "\n");
    commit_outputs(std::move(files));
  } catch (const std::exception&) {  // The disk may be full.
    if (keeper.write()) tell({"the work is kept: --resume continues from " + keep.file.string()}, run.quiet);
    throw;
  }
  keeper.remove();
}

/// Renders a scene to its files. @return the loaded scene.
Scene render_to_files(const SceneDescription& description, const RenderRun& run, std::optional<Scene> loaded,
                      Progress& progress) {
  OutputFiles files = open_files(description, run);  // First: a folder that cannot be written is named for the picture.
  KeepSettings keep = keep_settings(description, run);
  keep.cancelled = &progress.cancelled;
  std::optional<ProgressBar> bar(std::in_place, progress, run.quiet);
  Scene scene = load(description, loaded, progress);
  bar.reset();
  tell(scene.notes, run.quiet);
  // Errors come with the first image.
  const std::future<void> images = std::async(std::launch::async, prepare_images, written_by(description, run));
  KeptWork kept = read_kept_work(keep.file, run, scene);
  RenderJob job{Work(run.keeping.shard.value_or(WorkPart{}), std::move(kept.units)),
                {},
                nullptr,
                Work({}, std::move(kept.before))};
  naming_kept_work(kept.file, [&] { complete(scene, job, std::move(files), keep, run, progress); });
  for (const std::filesystem::path& file : written_by(description, run))
    if (!run.quiet) tell_made("wrote " + file.string());
  return scene;
}

/// A sequence reads its scene for each frame. @throw SceneError if it comes through a pipe.
void require_file(const std::filesystem::path& scene_file) {
  std::error_code none;
  if (std::filesystem::is_other(scene_file, none))
    throw SceneError(printable(scene_file.string()) +
                     ": a sequence reads its scene for each frame, and a pipe is read once; save the scene to a file");
}

/// @throw SceneError if two frames have a file in common.
void check_names(const std::filesystem::path& scene_file, SceneChanges changes, const std::vector<int>& frames,
                 const RenderRun& run) {
  std::vector<std::vector<std::filesystem::path>> names;
  for (std::size_t i = 0; i < frames.size() && names.size() < 2; ++i) {
    changes.frame = frames[i];
    try {
      names.push_back(files_of(read_scene(scene_file, changes), at_frame(run, frames[i])));
    } catch (const std::invalid_argument&) {
      if (!run.keep_going) throw;  // Else it is reported when its turn comes.
    }
  }
  if (names.size() < 2) return;
  for (const std::filesystem::path& name : names[0])
    if (std::find(names[1].begin(), names[1].end(), name) != names[1].end())
      throw SceneError(
          printable(fmt::format("{}: each frame would replace it; count frames by # in its name, as in "
                                "picture.####.png",
                                name.string())));
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

/// Pages of a field that is larger than the memory are on the disk of the result.
void bound_memory_of(const RenderRun& run, const SceneDescription& description) {
  if (run.memory > 0)
    bound_memory(run.memory, std::filesystem::absolute(written_by(description, run).front()).parent_path());
}

/// Renders a frame of a sequence. @param job  Its number, and what its scene leaves open.
void render_frame(const std::filesystem::path& scene_file, SceneChanges changes, const Json& job, const RenderRun& run,
                  std::optional<Scene>& loaded, Progress& progress) {
  const int frame = job.at("frame").get<int>();
  changes.frame = frame;
  SceneDescription description = read_scene(scene_file, changes);
  if (job.contains("scale")) set_chosen(job, description);
  bound_memory_of(run, description);
  const RenderRun with_number = at_frame(run, frame);
  const std::vector<std::filesystem::path> files = files_of(description, with_number);
  const std::filesystem::path checkpoint = checkpoint_of(description, with_number.keeping);
  const bool is_done =
      std::all_of(files.begin(), files.end(), is_there) && (checkpoint.empty() || !is_there(checkpoint));
  if (run.skip_existing && is_done) return;
  tell({fmt::format("frame {}", frame)}, run.quiet);
  Scene rendered = render_to_files(description, with_number, std::move(loaded), progress);
  loaded.emplace(std::move(rendered));
}

/// What is left of the frames so far.
struct EarlierFrames {
  std::optional<Scene> loaded;  ///< Of the last one.
  std::vector<int> failed;
};

/// The same. With --keep-going, a frame that fails is noted, and others follow.
void try_frame(const std::filesystem::path& scene_file, const SceneChanges& changes, const Json& job,
               const RenderRun& run, EarlierFrames& earlier, Progress& progress) {
  if (!run.keep_going) return render_frame(scene_file, changes, job, run, earlier.loaded, progress);
  const int frame = job.at("frame").get<int>();
  try {
    render_frame(scene_file, changes, job, run, earlier.loaded, progress);
  } catch (const Cancelled&) {
    throw;
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    tell({fmt::format("tensorray: frame {}: {}", frame, reason_of(error))}, false);
    earlier.failed.push_back(frame);
    earlier.loaded.reset();
  }
}

/// What the frames of a sequence have in common.
struct Sequence {
  Json job = Json::object();  ///< The scale and the direction, where scenes leave them open.
  bool is_divided = false;
};

/// That of its first frame; where the run keeps going, of the first one that can be loaded, or nothing if none can:
/// each then fails when its turn comes.
Sequence sequence_of(const std::filesystem::path& scene_file, SceneChanges changes, const std::vector<int>& frames,
                     const RenderRun& run, std::optional<Scene>& loaded, Progress& progress) {
  for (const int frame : frames) {
    try {
      changes.frame = frame;
      const SceneDescription first = read_scene(scene_file, changes);
      bound_memory_of(run, first);
      if (!first.field.scale || !first.light.direction) loaded = load_scene(first, progress);
      const Eigen::Vector3d direction = loaded ? *loaded->description.light.direction : *first.light.direction;
      return {{{"scale", loaded ? loaded->scale.scale : *first.field.scale},
               {"direction", {direction.x(), direction.y(), direction.z()}}},
              first.integrator.method().is_divided()};
    } catch (const Cancelled&) {
      throw;
    } catch (const std::invalid_argument&) {
      if (!run.keep_going || frame == frames.back()) throw;
    } catch (const std::exception&) {
      if (!run.keep_going) throw;
    }
  }
  return {};
}

/// Does units of a render of rank 0, until there are none left. @throw SceneError if its files are not those of rank 0.
void render_units(const RankJob& job, const Json& order, const RenderRun& run, std::optional<Scene>& loaded,
                  Follower& follower, const Progress& progress) {
  const Json& origin = order.at("origin");
  SceneDescription description =
      read_scene_json(origin.at("scene"), path_of_text(order.at("scene_file").get<std::string>()));
  set_chosen(origin, description);
  // Steps depend on what rank 0 writes; the origin does not say it.
  description.output.files.clear();
  for (const auto& [kind, file] : order.at("outputs").items())
    description.output.files[kind] = path_of_text(file.get<std::string>());
  bound_memory_of(run, description);
  Scene scene = load(description, loaded, progress);
  const std::string other = difference(origin, origin_of(scene));
  if (!other.empty())
    throw SceneError(printable(fmt::format("{}: is not that of rank 0: {}", description.path.string(), other)));
  RenderJob units{Work({order.at("part").at(0).get<std::size_t>(), order.at("part").at(1).get<std::size_t>()}), {}};
  units.work.is_shard = order.at("is_shard").get<bool>();
  const std::unique_ptr<Team> team = follower.team(job);
  units.team = team.get();
  if (description.integrator.method().is_divided()) follower.share(job, units.work, running_threads());
  render(scene, progress, &units);
  loaded.emplace(std::move(scene));
}

}  // namespace

void render_scene(const std::filesystem::path& scene_file, const SceneChanges& changes, const RenderRun& run,
                  Progress& progress) {
  const Threads threads(run.threads);
  set_image_threads(static_cast<int>(running_threads()));
  const SceneDescription description = read_scene(scene_file, changes);
  refuse_number_signs(description, run);
  bound_memory_of(run, description);
  const Method& method = description.integrator.method();
  if (run.leader && !method.has_shards())
    tell({fmt::format("note: the work of {} is one piece, which one rank does; mpirun divides a sequence (--frames)",
                      method.name())},
         run.quiet);
  if (is_field_file(scene_file)) tell({"scene: " + description.text}, run.quiet);
  render_to_files(description, run, {}, progress);
}

std::vector<int> render_frames(const std::filesystem::path& scene_file, SceneChanges changes,
                               const std::vector<int>& frames, const RenderRun& run, Progress& progress) {
  const Threads threads(run.threads);
  set_image_threads(static_cast<int>(running_threads()));
  require_file(scene_file);
  check_names(scene_file, changes, frames, run);
  EarlierFrames earlier;
  auto [job, is_divided] = sequence_of(scene_file, changes, frames, run, earlier.loaded, progress);
  std::deque<std::string> jobs;
  for (const int frame : frames) {
    job["frame"] = frame;
    jobs.push_back(job.dump());
  }
  const bool is_handed_out = run.leader && !is_divided;
  RenderRun run_of_frame = run;
  if (is_handed_out) {
    run.leader->offer(std::exchange(jobs, {}));
    run_of_frame.leader = nullptr;  // Each frame is that of one rank.
  }
  for (;;) {
    std::optional<std::string> next = is_handed_out ? run.leader->take() : std::nullopt;
    if (!is_handed_out && !jobs.empty()) {
      next = jobs.front();
      jobs.pop_front();
    }
    if (!next) return earlier.failed;
    try_frame(scene_file, changes, parse_value(*next), run_of_frame, earlier, progress);
  }
}

std::vector<int> follow(const std::filesystem::path& scene_file, const SceneChanges& changes, const RenderRun& run,
                        Follower& follower, Progress& progress) {
  const Threads threads(run.threads);
  set_image_threads(static_cast<int>(running_threads()));
  EarlierFrames earlier;
  while (const std::optional<RankJob> job = follower.next_job()) {
    const Json order = parse_value(job->text);
    if (order.contains("frame"))
      try_frame(scene_file, changes, order, run, earlier, progress);
    else
      render_units(*job, order, run, earlier.loaded, follower, progress);
  }
  return earlier.failed;
}

void write_merged(const SceneDescription& description, const WorkFile& work, const RenderRun& run, Progress& progress) {
  const Threads threads(run.threads);
  set_image_threads(static_cast<int>(running_threads()));
  OutputFiles files = open_files(description, run);
  const Scene scene = load_scene(description, progress);
  const std::string other = difference(work.origin, origin_of(scene));
  if (!other.empty())
    throw SceneError(
        printable(fmt::format("{}: has changed since the shards were made: {}; undo the change, or make them "
                              "again",
                              description.path.string(), other)));
  RenderJob job{Work({}, work.units), {}, nullptr, Work({}, kept_before(work.before))};
  naming_kept_work("a shard", [&] { complete(scene, job, std::move(files), {}, run, progress); });
  for (const std::filesystem::path& file : written_by(description, run))
    if (!run.quiet) tell_made("wrote " + file.string());
}

}  // namespace tensorray
