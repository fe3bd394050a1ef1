#include <map>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/files/distinct_files.h"
#include "base/text/text.h"
#include "scenes/jobs/origin.h"
#include "scenes/jobs/work_file.h"
#include "tools/commands/commands.h"
#include "tools/rendering/render_scene.h"

namespace tensorray {
namespace {

struct MergeOptions {
  std::vector<std::string> shards;
  std::vector<std::filesystem::path> outputs;
  RenderRun run;
};

/// Adds the units of a shard to those of the others.
void unite(const std::string& file, WorkFile shard, WorkFile& all) {
  const auto fail = [&](const std::string& what) { throw std::invalid_argument(printable(file + ": " + what)); };
  const std::string other = difference(shard.origin, all.origin);
  if (!other.empty()) fail("is of another render than the first shard: " + other);
  if (shard.part.count != all.part.count)
    fail(fmt::format("is one of {} shards, the first one of {}", shard.part.count, all.part.count));
  if (shard.units.size() != all.units.size()) fail("has another number of units than the first shard");
  for (std::size_t i = shard.part.index; i < shard.units.size(); i += shard.part.count) {
    if (!shard.units[i].done)
      fail(fmt::format("is not complete; continue it with --shard {}/{} --resume", shard.part.index + 1,
                       shard.part.count));
    all.units[i] = std::move(shard.units[i]);
  }
}

/// All units. @throw std::invalid_argument naming shards that are missing, repeated, incomplete or of another render.
WorkFile read_shards(const std::vector<std::string>& files) {
  WorkFile all;
  std::map<std::size_t, std::string> names;
  for (const std::string& file : files) {
    WorkFile shard = read_work(file);
    if (names.empty()) {
      all = shard;
      all.units.assign(shard.units.size(), {});
    }
    const std::size_t index = shard.part.index;
    unite(file, std::move(shard), all);
    const auto [before, is_new] = names.emplace(index, file);
    if (!is_new)
      throw std::invalid_argument(printable(fmt::format("{} and {} are both shard {}/{}; name one of them",
                                                        before->second, file, index + 1, all.part.count)));
  }
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < all.part.count; ++i)
    if (names.count(i) == 0) missing.push_back(fmt::format("{}/{}", i + 1, all.part.count));
  if (!missing.empty())
    throw std::invalid_argument(fmt::format("missing {} {}: render with --shard, and name all files",
                                            missing.size() > 1 ? "shards" : "shard", joined(missing)));
  return all;
}

void merge(const MergeOptions& options, Progress& progress) {
  std::vector<NamedFile> inputs, outputs{{options.run.statistics, "--stats"}};
  for (const std::string& shard : options.shards) inputs.push_back({shard, "the shard"});
  for (const std::filesystem::path& output : options.outputs) outputs.push_back({output, "-o"});
  require_distinct_files(inputs, outputs);
  const WorkFile work = read_shards(options.shards);
  SceneDescription description =
      read_scene_json(work.origin.at("scene"), work.scene_file, {{}, options.outputs, std::nullopt});
  set_chosen(work.origin, description);
  write_merged(description, work, options.run, progress);
}

}  // namespace

void add_merge_command(CLI::App& program, Progress& progress) {
  const auto options = std::make_shared<MergeOptions>();
  CLI::App* command = program.add_subcommand("merge", "Make the pictures of shards that `render --shard` wrote");
  command->add_option("SHARD", options->shards, "All shards of a render, in any order")->required();
  command->add_option("-o,--output", options->outputs, "Pictures, as for `tensorray render`")
      ->required()
      ->allow_extra_args(false);
  command->add_option("--threads", options->run.threads, "Number of threads (all)")->check(CLI::Range(1, 4096));
  command->add_option("--stats", options->run.statistics, "Write statistics of the merging to this JSON file");
  command->add_flag("-q,--quiet", options->run.quiet, "Print nothing but errors");
  options->run.keeping.is_on = false;
  command->callback([options, &progress] { merge(*options, progress); });
}

}  // namespace tensorray
