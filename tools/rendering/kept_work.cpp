#include "tools/rendering/kept_work.h"

#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "scenes/jobs/origin.h"
#include "scenes/jobs/work_file.h"
#include "tools/command_line/tell.h"

namespace tensorray {
namespace {

WorkFile read_checkpoint(const std::filesystem::path& file, const RenderRun& run, const Scene& scene) {
  std::error_code none;
  if (!run.keeping.resume || file.empty() || !std::filesystem::exists(file, none)) return {};
  WorkFile kept = read_work(file);
  const WorkPart part = run.keeping.shard.value_or(WorkPart{});
  std::string other = difference(kept.origin, origin_of(scene));
  if (kept.part.index != part.index || kept.part.count != part.count)
    other = fmt::format("it is part {} of {}", kept.part.index + 1, kept.part.count);
  if (!other.empty())
    throw SceneError(printable(fmt::format(
        "{}: is the checkpoint of another render: {}; undo the change, or remove the file", file.string(), other)));
  return kept;
}

std::vector<WorkUnit> read_light(const std::filesystem::path& file, const Scene& scene, bool quiet) {
  WorkFile work = read_work(file);
  if (const std::string other = difference(work.origin, origin_of(scene)); !other.empty())
    throw SceneError(printable(
        fmt::format("{}: is of another render: {}; undo the change, or leave --light out", file.string(), other)));
  if (!work.before.state)
    tell({fmt::format("note: {} has no light, because it was made quickly, or because another shard is the first one; "
                      "it is made again",
                      file.string())},
         quiet);
  return kept_before(std::move(work.before));
}

}  // namespace

KeptWork read_kept_work(const std::filesystem::path& checkpoint, const RenderRun& run, const Scene& scene) {
  WorkFile work = read_checkpoint(checkpoint, run, scene);
  KeptWork kept{std::move(work.units), kept_before(std::move(work.before)), {}};
  if (!kept.units.empty() || !kept.before.empty()) kept.file = checkpoint;
  if (run.keeping.light.empty() || !kept.before.empty()) return kept;
  kept.before = read_light(run.keeping.light, scene, run.quiet);
  if (kept.file.empty()) kept.file = run.keeping.light;
  return kept;
}

std::vector<WorkUnit> kept_before(WorkUnit before) {
  return before.state ? std::vector{std::move(before)} : std::vector<WorkUnit>();
}

void naming_kept_work(const std::filesystem::path& from, const std::function<void()>& work) {
  try {
    work();
  } catch (const DamagedWork& error) {
    if (from.empty()) throw;
    fail(from, error.what());
  }
}

}  // namespace tensorray
