#include "tools/rendering/run_outputs.h"

#include <fmt/format.h>

#include "base/files/distinct_files.h"
#include "base/text/path_text.h"
#include "scenes/description/check_scene.h"
#include "scenes/source/frames.h"

namespace tensorray {
namespace {

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

}  // namespace

OutputFiles open_files(const SceneDescription& description, const RenderRun& run) {
  check_scene_copy(description.path, run.scene_copy);
  const std::vector<NamedFile> more{
      {run.statistics, statistics_key}, {run.scene_copy, scene_key}, {run.keeping.shard_file, shard_key}};
  std::vector<NamedFile> all = more;
  all.push_back({checkpoint_of(description, run.keeping), "the checkpoint"});
  check_files(description, all, {{run.keeping.light, "--light"}});
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
