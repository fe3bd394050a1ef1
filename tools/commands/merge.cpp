#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/files/output_file.h"
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

void merge(const MergeOptions& options, Progress& progress) {
  std::vector<NamedFile> inputs, outputs{{options.run.statistics, "--stats"}};
  for (const std::string& shard : options.shards) inputs.push_back({shard, "the shard"});
  for (const std::filesystem::path& output : options.outputs) outputs.push_back({output, "-o"});
  require_distinct_files(inputs, outputs);
  WorkFile work = read_shards(options.shards);
  SceneDescription description =
      read_scene_json(work.origin.at("scene"), work.scene_file, {{}, options.outputs, std::nullopt});
  set_chosen(work.origin, description);
  merge_shards(description, std::move(work), options.run, progress);
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
