#include "tools/commands/render_scene.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <future>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "renderer/images/image.h"
#include "scenes/description/run_files.h"
#include "scenes/keys/json_reader.h"
#include "scenes/outputs/write_outputs.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "tools/command_line/progress_bar.h"
#include "tools/command_line/tell.h"
#include "tools/commands/statistics_json.h"

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

/// Gives all files their final names, or none of them.
void commit(OutputFiles files) {
  std::vector<OutputFile> complete;
  for (auto& [key, file] : files) complete.push_back(std::move(file));
  commit_all(complete);
}

}  // namespace

void render_scene(const std::filesystem::path& scene_file, const SceneChanges& changes, const RenderRun& run,
                  Progress& progress) {
  const unsigned threads = run.threads > 0 ? run.threads : std::max(1u, std::thread::hardware_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  set_image_threads(static_cast<int>(threads));

  const SceneDescription description = read_scene(scene_file, changes);
  OutputFiles files = open_files(description, run);
  if (is_field_file(scene_file)) tell({"scene: " + description.text}, run.quiet);

  std::optional<ProgressBar> bar(std::in_place, progress, run.quiet);
  const Scene scene = load_scene(description, progress);
  tell(scene.notes, run.quiet);
  const std::future<void> images = std::async(std::launch::async, prepare_images);  // Errors come with the first image.
  const Render result = render(scene, progress);
  bar.reset();  // Erase the bar before the notes are printed.
  for (const std::string& warning : result.warnings) tell({"warning: " + warning}, run.quiet);

  const auto start = std::chrono::steady_clock::now();
  write_outputs(result, scene, files);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!run.statistics.empty())
    write_text(files.at(statistics_key), statistics_json(scene, result.statistics, seconds, static_cast<int>(threads)));
  if (!run.scene_copy.empty()) write_text(files.at(scene_key), parse_value(description.text).dump(2) + "\n");
  commit(std::move(files));
  for (const auto& [key, path] : description.output.files)
    if (!run.quiet) fmt::print("wrote {}\n", path.string());
}

}  // namespace tensorray
