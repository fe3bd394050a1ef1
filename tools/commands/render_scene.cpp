#include "tools/commands/render_scene.h"

#include <algorithm>
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
#include "scenes/keys/frames.h"
#include "scenes/keys/json_reader.h"
#include "scenes/outputs/statistics_json.h"
#include "scenes/outputs/write_outputs.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "tools/command_line/progress_bar.h"
#include "tools/command_line/tell.h"

namespace tensorray {
namespace {

/// Keys among the outputs, because all files are committed together.
const std::string statistics_key = "--stats", scene_key = "--save-scene";

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
  const std::vector<NamedFile> more{{run.statistics, statistics_key}, {run.scene_copy, scene_key}};
  check_files(description, more);
  OutputFiles files = open_outputs(description.output);
  for (const NamedFile& file : more)
    if (!file.path.empty()) files.emplace(file.name, OutputFile(file.path));
  return files;
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

/// Renders a scene to its files. @return the loaded scene.
Scene render_to_files(const SceneDescription& description, const RenderRun& run, std::optional<Scene> loaded,
                      Progress& progress) {
  OutputFiles files = open_files(description, run);
  std::optional<ProgressBar> bar(std::in_place, progress, run.quiet);
  Scene scene = load(description, loaded, progress);
  tell(scene.notes, run.quiet);
  const std::future<void> images = std::async(std::launch::async, prepare_images);  // Errors come with the first image.
  const Render result = render(scene, progress);
  bar.reset();  // Erase the bar before the notes are printed.
  for (const std::string& warning : result.warnings) tell({"warning: " + warning}, run.quiet);

  const auto start = Clock::now();
  write_outputs(result, scene, files);
  if (!run.statistics.empty())
    write_text(files.at(statistics_key),
               statistics_json(scene, result.statistics, seconds_since(start), static_cast<int>(threads_of(run))));
  if (!run.scene_copy.empty()) write_text(files.at(scene_key), parse_value(description.text).dump(2) + "\n");
  commit_outputs(std::move(files));
  for (const auto& [key, path] : description.output.files)
    if (!run.quiet) fmt::print("wrote {}\n", path.string());
  return scene;
}

RenderRun at_frame(RenderRun run, int frame) {
  run.statistics = numbered(run.statistics.string(), frame);
  return run;
}

std::vector<std::filesystem::path> files_of(const SceneDescription& description, const RenderRun& run) {
  std::vector<std::filesystem::path> files;
  for (const auto& [key, path] : description.output.files) files.push_back(path);
  if (!run.statistics.empty()) files.push_back(run.statistics);
  return files;
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
    if (skip_existing && std::all_of(files.begin(), files.end(), exists)) continue;
    tell({fmt::format("frame {}", frame)}, run.quiet);
    Scene rendered = render_to_files(description, with_number, std::move(loaded), progress);
    loaded.emplace(std::move(rendered));
  }
}

}  // namespace tensorray
