#include "tools/rendering/rank_scene.h"

#include <exception>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "base/text/path_text.h"
#include "scenes/jobs/work_file.h"
#include "scenes/scene/render.h"

namespace tensorray {
namespace {

void copy_results(Results& results, Archive& archive) {
  std::size_t count = results.size();
  archive.copy(count);
  auto result = results.begin();
  for (std::size_t i = 0; i < count; ++i) {
    std::string name = archive.reads() ? std::string() : result->first;
    std::string bytes = archive.reads() ? std::string() : *result->second;
    archive.copy_list(name);
    archive.copy_list(bytes);
    if (archive.reads())
      results[name] = std::make_shared<const std::string>(std::move(bytes));
    else
      ++result;
  }
}

/// The scene without its files, which others do not write.
SceneDescription description_of(const Json& order) {
  SceneDescription description =
      read_scene_json(order.at("scene"), path_of_text(order.at("scene_file").get<std::string>()));
  description.output.files.clear();  // But what is made depends on which there are.
  for (const auto& [kind, file] : order.at("outputs").items())
    description.output.files[kind] = path_of_text(file.get<std::string>());
  return description;
}

}  // namespace

void send_scene(Ranks& ranks, const SceneDescription& description, const RenderRun& run) {
  Json scene = parse_value(description.text), outputs = Json::object();
  scene.erase("output");
  if (description.output.fluence_bands) scene["output"]["fluence_bands"] = true;
  for (const auto& [kind, file] : description.output.files)
    outputs[kind] = text_of_path(std::filesystem::absolute(file));
  const WorkPart part = run.keeping.shard.value_or(WorkPart{});
  Json order = {{"scene", scene},
                {"scene_file", text_of_path(std::filesystem::absolute(description.path))},
                {"outputs", outputs},
                {"part", {part.index, part.count}},
                {"is_shard", run.keeping.shard.has_value()}};
  std::string text = order.dump();
  broadcast_list(&ranks, text);
}

void agree(Ranks& ranks, const Scene& scene, Results& earlier) {
  const Json mine = origin_of(scene);
  std::string text = mine.dump(), bytes;
  broadcast_list(&ranks, text);
  const std::string other = difference(parse_value(text), mine);
  if (!other.empty())
    throw SceneError(printable(fmt::format("{}: is not that of rank 0: {}", scene.description.path.string(), other)));
  if (is_root(&ranks)) {
    Archive archive;
    copy_results(earlier, archive);
    bytes = archive.take();
  }
  broadcast_list(&ranks, bytes);
  if (is_root(&ranks)) return;
  Archive archive(bytes);
  copy_results(earlier, archive);
}

void render_with_root(Ranks& ranks, const RenderRun& run, Progress& progress) {
  std::string text;
  broadcast_list(&ranks, text);
  const Json order = parse_value(text);
  std::optional<Scene> scene;
  std::exception_ptr error;
  try {
    const SceneDescription description = description_of(order);
    bound_memory_of(run, description);
    scene.emplace(load_scene(description, progress));
  } catch (const Cancelled&) {
    throw;
  } catch (...) {
    error = std::current_exception();
  }
  // What fails at the root, too, is said there. It answers if it has loaded the scene.
  if (error) {
    broadcast_list(&ranks, text);
    std::rethrow_exception(error);
  }
  Results earlier;
  agree(ranks, *scene, earlier);
  RenderJob job({order.at("part").at(0).get<std::size_t>(), order.at("part").at(1).get<std::size_t>()},
                std::move(earlier));
  job.is_shard = order.at("is_shard").get<bool>();
  job.ranks = &ranks;
  render(*scene, progress, &job);
  if (job.stopping) throw Cancelled();
}

}  // namespace tensorray
