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
#include "scenes/outputs/write_outputs.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "tools/command_line/progress_bar.h"
#include "tools/command_line/tell.h"
#include "tools/commands/statistics_json.h"

namespace tensorray {
namespace {

/// The key of the statistics file among the outputs, because all files are committed together.
const std::string statistics_key = "--stats";

void write_text(OutputFile& file, const std::string& text) {
  file.write([&](const std::filesystem::path& path) {
    std::ofstream stream(path, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw std::runtime_error("cannot write " + path.string() + ": the disk may be full");
  });
}

OutputFiles open_files(const SceneDescription& description, const std::filesystem::path& statistics) {
  check_files(description, {{statistics, statistics_key}});
  OutputFiles files = open_outputs(description.output);
  if (!statistics.empty()) files.emplace(statistics_key, OutputFile(statistics));
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
  OutputFiles files = open_files(description, run.statistics);

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
  commit(std::move(files));
  for (const auto& [key, path] : description.output.files)
    if (!run.quiet) fmt::print("wrote {}\n", path.string());
}

}  // namespace tensorray
